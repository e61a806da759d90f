#include "core/encoder/lpips/lpips.h"

#include <torch/types.h>

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/lpips/lpips_network.h"
#include "core/encoder/torch_errors.h"
#include "core/weights/weight_file.h"

namespace color3d {
namespace {

constexpr int kSmallestSidePx = 64;  // both networks reduce by 16 and more

torch::Tensor RgbTensor(const Image& srgb) {
  if (std::min(srgb.width, srgb.height) < kSmallestSidePx ||
      (srgb.channels != 1 && srgb.channels != 3)) {
    throw InvalidArgument(
        "LPIPS takes pictures of {} px and more with 1 or 3 channels, but got {} x {} px with {}",
        kSmallestSidePx,
        srgb.width,
        srgb.height,
        srgb.channels);
  }
  return TensorFromImage(srgb).expand({1, 3, srgb.height, srgb.width});
}

}  // namespace

std::shared_ptr<const Lpips> Lpips::FromWeightFiles(const std::filesystem::path& backbone,
                                                    const std::filesystem::path& linear) {
  return std::make_shared<const Lpips>(ReadWeightFile(backbone), ReadWeightFile(linear));
}

Lpips::Lpips(WeightMap backbone, WeightMap linear) {
  WithTorchErrors("LPIPS", [&] {
    at::NoGradGuard no_grad;
    network_ = std::make_unique<const LpipsNetwork>(std::move(backbone), std::move(linear));
  });
  description_ = network_->ToString();
}

Lpips::~Lpips() = default;

double Lpips::Distance(const Image& srgb, const Image& other_srgb) const {
  const torch::Tensor one = RgbTensor(srgb), other = RgbTensor(other_srgb);
  if (srgb.width != other_srgb.width || srgb.height != other_srgb.height) {
    throw InvalidArgument("LPIPS compares pictures of one size, not {} x {} and {} x {} px",
                          srgb.width,
                          srgb.height,
                          other_srgb.width,
                          other_srgb.height);
  }
  return WithTorchErrors("LPIPS", [&] {
    at::NoGradGuard no_grad;
    return network_->Distance(one, other);
  });
}

}  // namespace color3d
