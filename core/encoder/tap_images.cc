#include "core/encoder/tap_images.h"

#include <torch/torch.h>

#include <utility>

#include "core/base/error.h"
#include "core/encoder/convnext/convnext.h"
#include "core/encoder/image_tensors.h"
#include "core/encoder/torch_errors.h"

namespace color3d {

std::vector<TapImage> TapImages(const Encoder& encoder, const Image& luminance) {
  const auto* network = dynamic_cast<const ConvNext*>(&encoder);
  if (network == nullptr) {
    throw InvalidArgument(
        "the encoder ({}) has no feature maps; use a ConvNeXt or the embedded one",
        encoder.description());
  }
  const ConvNextConfig& config = network->config();
  const int multiple = config.Stride(config.StageCount() - 1);
  return WithTorchErrors("encoder", [&] {
    torch::NoGradGuard no_grad;
    const int right = (multiple - luminance.width % multiple) % multiple;
    const int bottom = (multiple - luminance.height % multiple) % multiple;
    torch::Tensor l = TensorFromImage(luminance);
    if (right > 0 || bottom > 0) l = torch::replication_pad2d(l, {0, right, 0, bottom});
    const std::vector<torch::Tensor> taps = network->Taps(network->Input(l));
    std::vector<TapImage> images;
    for (size_t k = 0; k < taps.size(); ++k) {
      const int stride = config.Stride(static_cast<int>(k));
      const int rows = (luminance.height + stride - 1) / stride;
      const int columns = (luminance.width + stride - 1) / stride;
      images.push_back({stride, ImageFromTensor(taps[k].slice(2, 0, rows).slice(3, 0, columns))});
    }
    return images;
  });
}

}  // namespace color3d
