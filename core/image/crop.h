// Parts of pictures. Pure function, thread-safe.
#pragma once

#include <algorithm>

#include "core/base/image.h"

namespace color3d {

// Returns the part of the given size whose upper left pixel is at (left, top). Requires: the part
// lies inside `image`.
inline Image Crop(const Image& image, int left, int top, int width, int height) {
  Image part(width, height, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (int y = 0; y < height; ++y) {
      const float* row = image.Plane(c) + static_cast<size_t>(top + y) * image.width;
      std::copy_n(row + left, width, &part.At(c, y, 0));
    }
  }
  return part;
}

}  // namespace color3d
