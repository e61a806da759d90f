// Resampling of pictures at given positions. Pure functions, thread-safe.
#pragma once

#include <vector>

#include "core/base/image.h"

namespace color3d {

// Position in the source for every pixel of the result, row by row; pixel centres are at integers.
struct RemapTable {
  int width = 0;
  int height = 0;
  std::vector<float> x;
  std::vector<float> y;
};

// Bicubic (Keys 1981 with a = -1/2, the only cubic convolution that reproduces ramps; OpenCV's,
// with a = -3/4 and positions in 1/32 px, moves edges by up to 0.06 px). Overshoot is clamped to
// the range of each channel. Border pixels are replicated.
Image CubicRemap(const Image& image, const RemapTable& table);

}  // namespace color3d
