#include "core/encoder/inception/inception.h"

#include <torch/types.h>

#include <utility>

#include "core/base/error.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/inception/inception_network.h"
#include "core/encoder/torch_errors.h"
#include "core/weights/weight_file.h"

namespace color3d {

std::shared_ptr<const Inception> Inception::FromWeightFile(const std::filesystem::path& path) {
  return std::make_shared<const Inception>(ReadWeightFile(path));
}

Inception::Inception(WeightMap weights) {
  WithTorchErrors("Inception", [&] {
    at::NoGradGuard no_grad;
    network_ = std::make_unique<const InceptionNetwork>(std::move(weights));
  });
  description_ = network_->ToString();
}

Inception::~Inception() = default;

int Inception::feature_count() const { return network_->feature_count(); }

std::vector<float> Inception::Features(const Image& srgb) const {
  if (srgb.Empty() || (srgb.channels != 1 && srgb.channels != 3)) {
    throw InvalidArgument("Inception takes a picture with 1 or 3 channels, but got {}",
                          srgb.channels);
  }
  return WithTorchErrors("Inception", [&] {
    at::NoGradGuard no_grad;
    const torch::Tensor rgb = TensorFromImage(srgb).expand({1, 3, srgb.height, srgb.width});
    return TensorValues(network_->Features(rgb));
  });
}

}  // namespace color3d
