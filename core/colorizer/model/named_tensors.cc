#include "core/colorizer/model/named_tensors.h"

#include <torch/types.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"

namespace color3d {

void PutTensors(const NamedTensors& tensors,
                const std::string& prefix,
                StoredType type,
                TensorFile* file) {
  for (const auto& [name, tensor] : tensors) {
    const torch::Tensor plain =
        tensor.detach().to(torch::kFloat32).contiguous(at::MemoryFormat::Contiguous);
    const float* values = plain.data_ptr<float>();
    file->arrays[prefix + name] = {plain.sizes().vec(), {values, values + plain.numel()}};
    if (type == StoredType::kFloat16) file->half.insert(prefix + name);
  }
}

void TakeTensors(const NamedTensors& tensors,
                 const std::string& prefix,
                 const std::string& what,
                 TensorFile* file) {
  torch::NoGradGuard no_grad;
  for (const auto& [name, tensor] : tensors) {
    const auto found = file->arrays.find(prefix + name);
    if (found == file->arrays.end()) {
      throw InvalidArgument("{} has no array \"{}{}\"", what, prefix, name);
    }
    std::vector<float>& values = found->second.values;
    if (found->second.shape != tensor.sizes().vec()) {
      throw InvalidArgument("{} has array \"{}{}\" in another shape", what, prefix, name);
    }
    if (!std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); })) {
      throw InvalidArgument("{} has numbers that are not finite in \"{}{}\"", what, prefix, name);
    }
    torch::Tensor target = tensor;
    target.copy_(torch::from_blob(values.data(), found->second.shape, torch::kFloat32));
    file->arrays.erase(found);
  }
}

}  // namespace color3d
