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

}  // namespace color3d
