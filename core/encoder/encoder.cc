#include "core/encoder/encoder.h"

#include <utility>

#include "core/base/error.h"
#include "core/encoder/clip/clip.h"
#include "core/encoder/clip/clip_weights.h"
#include "core/encoder/convnext/convnext.h"
#include "core/encoder/convnext/convnext_weights.h"
#include "core/encoder/embedded/embedded_weights.h"
#include "core/encoder/torch_errors.h"
#include "core/weights/weight_file.h"

namespace color3d {

std::shared_ptr<const Encoder> Encoder::Embedded() {
  // Not cached: unpacking 4 M weights takes milliseconds, and no global state outlives the caller.
  const ConvNextConfig config;
  return std::make_shared<const ConvNext>(
      config, EmbeddedWeights("encoder."), "embedded ConvNeXt, " + config.ToString());
}

std::shared_ptr<const Encoder> Encoder::FromWeightFile(const std::filesystem::path& path) {
  WeightMap weights = ReadWeightFile(path);
  if (HoldsConvNext(weights)) {
    ConvNextWeights found = TakeConvNextWeights(weights);
    weights.clear();  // decoder, not needed here
    return WithTorchErrors("encoder", [&] {
      return std::make_shared<const ConvNext>(
          found.config, std::move(found.weights), found.description);
    });
  }
  if (HoldsClip(weights)) {
    weights.clear();
    return ClipModel::FromWeightFile(path);
  }
  throw InvalidArgument(
      "{} has no known encoder ({} arrays); known are DDColor, ConvNeXt with its authors' names, "
      "and CLIP with a ViT",
      path.string(),
      weights.size());
}

}  // namespace color3d
