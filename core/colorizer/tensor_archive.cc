#include "core/colorizer/tensor_archive.h"

#include <torch/torch.h>

#include <cstring>

#include "core/base/error.h"

namespace color3d {

ArchiveArray ArrayFromTensor(const torch::Tensor& tensor, ArchiveArray::Type type) {
  const bool half = type == ArchiveArray::Type::kFloat16;
  const torch::Tensor plain = tensor.detach()
                                  .to(half ? torch::kHalf : torch::kFloat32)
                                  .contiguous(at::MemoryFormat::Contiguous);
  ArchiveArray array;
  array.type = type;
  array.shape = plain.sizes().vec();
  array.bytes.assign(static_cast<const char*>(plain.data_ptr()), plain.nbytes());
  return array;
}

torch::Tensor TensorFromArray(const ArchiveArray& array) {
  const bool half = array.type == ArchiveArray::Type::kFloat16;
  torch::Tensor plain = torch::empty(array.shape, half ? torch::kHalf : torch::kFloat32);
  std::memcpy(plain.data_ptr(), array.bytes.data(), array.bytes.size());
  torch::Tensor tensor = plain.to(torch::kFloat32);
  return tensor.dim() == 4 ? tensor.contiguous(at::MemoryFormat::ChannelsLast) : tensor;
}

void PutTensors(const NamedTensors& tensors,
                const std::string& prefix,
                ArchiveArray::Type type,
                Archive& archive) {
  for (const auto& [name, tensor] : tensors) {
    archive.arrays[prefix + name] = ArrayFromTensor(tensor, type);
  }
}

void TakeTensors(const NamedTensors& tensors,
                 const std::string& prefix,
                 const std::string& what,
                 Archive& archive) {
  torch::NoGradGuard no_grad;
  for (const auto& [name, tensor] : tensors) {
    const auto found = archive.arrays.find(prefix + name);
    if (found == archive.arrays.end()) {
      throw InvalidArgument(what + " lacks the array \"" + prefix + name + "\"");
    }
    if (found->second.shape != tensor.sizes().vec()) {
      throw InvalidArgument(what + " holds \"" + prefix + name + "\" with another shape");
    }
    const torch::Tensor value = TensorFromArray(found->second);
    if (!value.isfinite().all().item<bool>()) {
      throw InvalidArgument(what + " holds numbers that are not finite in \"" + prefix + name +
                            "\"");
    }
    torch::Tensor target = tensor;
    target.copy_(value);
    archive.arrays.erase(found);
  }
}

}  // namespace color3d
