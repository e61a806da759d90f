// Colouring a picture without any help from the user (STILL.md "Stage 1b", `auto`). No torch in
// this interface. Immutable after construction: any number of threads may colour.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/base/image.h"
#include "core/weights/weight_map.h"

namespace color3d {

struct AutomaticColor {
  Image ab;          // 2 channels, Lab units, size of the input
  Image confidence;  // 1 channel, 0..1: 1 where the answer is surely right, 1/2 where it is
                     // expected to be some 20 Lab units beside the true colour
};

class AutomaticColorizer {
 public:
  virtual ~AutomaticColorizer() = default;

  // `luminance`: 1 channel, L 0..100, any size. Throws Error{kInvalidArgument} for another channel
  // count or an empty picture.
  virtual AutomaticColor Colorize(const Image& luminance) const = 0;
  virtual const std::string& description() const = 0;  // one line for reports
  virtual const std::string& digest() const = 0;       // SHA-256 of architecture and weights

  // Our own, pre-trained; its weights are part of the program.
  static std::shared_ptr<const AutomaticColorizer> Embedded();
  // The same network with other weights, as `color3d-bench pretrain` writes them: "encoder.*",
  // "color_head.*", "color_bins" [K,2], "color_temperature" [1] and, where there is one,
  // "color_weights" [K], above 0: how much more often than it is each colour was counted. Throws
  // Error{kInvalidArgument} naming what is missing or misshapen.
  static std::shared_ptr<const AutomaticColorizer> FromPretrained(const WeightMap& weights);
  // DDColor's published weights, any size.
  static std::shared_ptr<const AutomaticColorizer> FromWeightFile(
      const std::filesystem::path& ddcolor_weights);
};

}  // namespace color3d
