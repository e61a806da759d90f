// Colouring without any hint: a network guesses from L alone (METHOD.md "Stage 1b", `auto`).
// Immutable after construction, thread-safe. No torch in this interface.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "core/base/image.h"

namespace color3d {

struct AutomaticColor {
  Image ab;          // 2 channels, Lab units, size of the input
  Image confidence;  // 1 channel, 0..1
};

class AutomaticColorizer {
 public:
  virtual ~AutomaticColorizer() = default;

  // `luminance`: 1 channel, L 0..100, any size. Throws Error{kInvalidArgument} on another picture.
  virtual AutomaticColor Colorize(const Image& luminance) const = 0;
  virtual const std::string& description() const = 0;  // one line for reports

  // The pre-trained network that the program carries.
  static std::shared_ptr<const AutomaticColorizer> Embedded();
  // A published DDColor (Kang et al. 2023), any size and file format. Throws
  // Error{kInvalidArgument} listing the weights that are missing, unexpected or misshapen.
  static std::shared_ptr<const AutomaticColorizer> FromWeightFile(
      const std::filesystem::path& ddcolor_weights);
};

}  // namespace color3d
