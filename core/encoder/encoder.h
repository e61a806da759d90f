// The frozen encoder that all scenes share: L picture in, feature maps out. Immutable after
// construction, so any number of threads may call it. No torch in this interface.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/base/image.h"

namespace color3d {

class Encoder {
 public:
  // The embedded encoder: a compact ConvNeXt, pre-trained by us (core/encoder/embedded/CARD.md).
  static std::shared_ptr<const Encoder> Embedded();
  // A published network: the ConvNeXt of a DDColor, a plain ConvNeXt (names as its authors'), or a
  // CLIP ViT, which describes pictures but cannot be personalized. Throws Error{kInvalidArgument}
  // listing the weights that are missing, unexpected or misshapen.
  static std::shared_ptr<const Encoder> FromWeightFile(const std::filesystem::path& path);
  virtual ~Encoder() = default;

  // SHA-256 over architecture and weights: names the encoder in colorizer files.
  virtual const std::string& digest() const = 0;
  virtual const std::string& description() const = 0;  // one line for reports

  // Pooled descriptor of a 1-channel L picture (0..100), for key view selection.
  virtual std::vector<double> Describe(const Image& luminance) const = 0;
  // Deep features on a coarse grid (stride 16): `channels` planes, for coverage.
  virtual Image DeepFeatures(const Image& luminance) const = 0;
};

}  // namespace color3d
