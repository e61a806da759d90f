// Automatic colourization of a picture (STILL.md "Stage 1b", `auto`). No torch in this interface.
// Immutable, thread-safe.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/base/image.h"
#include "core/weights/weight_map.h"

namespace color3d {

struct AutomaticColor {
  Image ab;          // 2 channels, Lab units, size of the input
  Image confidence;  // 1 channel, 0..1; 1: certain, 1/2: expected error of about 20 Lab units
};

class AutomaticColorizer {
 public:
  virtual ~AutomaticColorizer() = default;

  // `luminance`: 1 channel, L 0..100, any size. Throws Error{kInvalidArgument} for other channel
  // counts or empty pictures.
  virtual AutomaticColor Colorize(const Image& luminance) const = 0;
  virtual const std::string& description() const = 0;  // one line for reports
  virtual const std::string& digest() const = 0;       // SHA-256 of architecture and weights

  // The embedded network, pre-trained by us; its weights are part of the program.
  static std::shared_ptr<const AutomaticColorizer> Embedded();
  // The same network with other weights, as `color3d-bench pretrain` writes them: "encoder.*",
  // "color_head.*", "color_bins" [K,2], "color_temperature" [1] and optionally "color_weights" [K],
  // above 0: factors by which training overcounted each colour. Throws Error{kInvalidArgument}
  // naming arrays that are missing or misshapen.
  static std::shared_ptr<const AutomaticColorizer> FromPretrained(const WeightMap& weights);
  // DDColor with published weights of any size.
  static std::shared_ptr<const AutomaticColorizer> FromWeightFile(
      const std::filesystem::path& ddcolor_weights);
};

}  // namespace color3d
