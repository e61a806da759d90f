// All feature maps of a frozen encoder as plain pictures, for modules without torch.
#pragma once

#include <vector>

#include "core/base/image.h"
#include "core/encoder/encoder.h"

namespace color3d {

struct TapImage {
  int stride = 0;  // px of the picture per cell
  Image features;  // ceil(width / stride) x ceil(height / stride) cells, one plane per channel
};

// Fine to coarse. `luminance`: 1 channel, L 0..100; its borders are repeated as far as the coarsest
// stride needs. Throws Error{kInvalidArgument} when the encoder has no feature maps (CLIP).
std::vector<TapImage> TapImages(const Encoder& encoder, const Image& luminance);

}  // namespace color3d
