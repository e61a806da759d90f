// Bilinear sampling of planar pictures.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/base/image.h"

namespace color3d {

// The four pixels around a position, for all planes of pictures of one size. Pixel centres are at
// integers; positions outside use the nearest pixel.
class BilinearPlace {
 public:
  BilinearPlace(int width, int height, float x, float y) {
    const float cx = std::clamp(x, 0.0f, static_cast<float>(width - 1));
    const float cy = std::clamp(y, 0.0f, static_cast<float>(height - 1));
    const int x0 = static_cast<int>(cx), y0 = static_cast<int>(cy);
    const float fx = cx - static_cast<float>(x0), fy = cy - static_cast<float>(y0);
    const size_t right = x0 + 1 < width ? 1 : 0;
    const size_t below = y0 + 1 < height ? static_cast<size_t>(width) : 0;
    const size_t first = static_cast<size_t>(y0) * width + x0;
    pixel_ = {first, first + right, first + below, first + below + right};
    weight_ = {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy};
  }

  float Of(const float* plane) const {
    return weight_[0] * plane[pixel_[0]] + weight_[1] * plane[pixel_[1]] +
           weight_[2] * plane[pixel_[2]] + weight_[3] * plane[pixel_[3]];
  }

 private:
  std::array<size_t, 4> pixel_;
  std::array<float, 4> weight_;
};

inline float SampleBilinear(const Image& image, int channel, double x, double y) {
  return BilinearPlace(image.width, image.height, static_cast<float>(x), static_cast<float>(y))
      .Of(image.Plane(channel));
}

// Samples `image` at `place`, 2 channels of the result's size: x and y in px.
inline Image SampledAt(const Image& image, const Image& place) {
  Image out(place.width, place.height, image.channels);
  for (size_t i = 0; i < place.PlaneSize(); ++i) {
    const BilinearPlace at(image.width, image.height, place.Plane(0)[i], place.Plane(1)[i]);
    for (int c = 0; c < image.channels; ++c) out.Plane(c)[i] = at.Of(image.Plane(c));
  }
  return out;
}

}  // namespace color3d
