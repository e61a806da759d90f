#include "core/encoder/image_tensors.h"

#include <torch/types.h>

#include <cstring>

namespace color3d {

torch::Tensor TensorFromImage(const Image& image) {
  torch::Tensor tensor =
      torch::empty({1, image.channels, image.height, image.width}, torch::kFloat32);
  std::memcpy(tensor.data_ptr<float>(), image.data.data(), image.data.size() * sizeof(float));
  return tensor;
}

Image ImageFromTensor(const torch::Tensor& tensor) {
  const torch::Tensor planar =
      (tensor.dim() == 4 ? tensor[0] : tensor).to(torch::kFloat32).contiguous();
  Image image(static_cast<int>(planar.size(2)),
              static_cast<int>(planar.size(1)),
              static_cast<int>(planar.size(0)));
  std::memcpy(image.data.data(), planar.data_ptr<float>(), image.data.size() * sizeof(float));
  return image;
}

std::vector<float> TensorValues(const torch::Tensor& tensor) {
  const torch::Tensor flat = tensor.contiguous();
  return {flat.data_ptr<float>(), flat.data_ptr<float>() + flat.numel()};
}

torch::Tensor PadByReplication(const torch::Tensor& x, int multiple) {
  const int64_t right = (multiple - x.size(3) % multiple) % multiple;
  const int64_t bottom = (multiple - x.size(2) % multiple) % multiple;
  return right > 0 || bottom > 0 ? torch::replication_pad2d(x, {0, right, 0, bottom}) : x;
}

}  // namespace color3d
