// A panning film for tests. Pure function.
#pragma once

#include <cmath>

#include "core/base/image.h"

namespace color3d {

// Frame `frame` of a pan along a textured wall, one pixel per frame. Its colour changes from left
// to right and from top to bottom. Lab.
inline Image WallPan(int width, int height, int frame) {
  Image lab(width, height, 3);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = x + 1.0 * frame;
      double l = 50.0;
      for (int k = 1; k <= 6; ++k) {
        const double a = 2.1 * k + 1.3;
        l += 4.0 * std::sin(0.13 * k * (u * std::cos(a) + y * std::sin(a)) + 2.7 * a);
      }
      lab.At(0, y, x) = static_cast<float>(l);
      lab.At(1, y, x) = static_cast<float>(20.0 * std::sin(0.03 * u));
      lab.At(2, y, x) = static_cast<float>(20.0 * std::cos(0.04 * y));
    }
  }
  return lab;
}

}  // namespace color3d
