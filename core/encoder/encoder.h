// Frozen encoder, shared by all scenes: maps an L picture to features. Immutable, thread-safe. No
// torch in this interface.
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
  // CLIP ViT, which has descriptors but no feature maps for the colorizer. Throws
  // Error{kInvalidArgument} listing weights that are missing, unexpected or misshapen.
  static std::shared_ptr<const Encoder> FromWeightFile(const std::filesystem::path& path);
  virtual ~Encoder() = default;

  // SHA-256 over architecture and weights, which identifies the encoder in colorizer files.
  virtual const std::string& digest() const = 0;
  virtual const std::string& description() const = 0;  // one line for reports

  // Returns the pooled descriptor of a 1-channel L picture (0..100), for key view selection.
  virtual std::vector<double> Describe(const Image& luminance) const = 0;
  // Returns deep features on a coarse grid (stride 16), for coverage.
  virtual Image DeepFeatures(const Image& luminance) const = 0;
};

}  // namespace color3d
