// Bilinear reading of a planar picture at any place.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/base/image.h"

namespace color3d {

// Pixel centres at whole numbers; beyond the border the nearest pixel.
inline float SampleBilinear(const Image& image, int channel, double x, double y) {
  const double cx = std::clamp(x, 0.0, image.width - 1.0);
  const double cy = std::clamp(y, 0.0, image.height - 1.0);
  const int x0 = static_cast<int>(cx), y0 = static_cast<int>(cy);
  const int x1 = std::min(x0 + 1, image.width - 1), y1 = std::min(y0 + 1, image.height - 1);
  const auto fx = static_cast<float>(cx - x0), fy = static_cast<float>(cy - y0);
  const float top = std::lerp(image.At(channel, y0, x0), image.At(channel, y0, x1), fx);
  const float bottom = std::lerp(image.At(channel, y1, x0), image.At(channel, y1, x1), fx);
  return std::lerp(top, bottom, fy);
}

// `image` at the places `place`, 2 channels of the result's size: x and y in px.
inline Image SampledAt(const Image& image, const Image& place) {
  Image out(place.width, place.height, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (size_t i = 0; i < place.PlaneSize(); ++i) {
      out.Plane(c)[i] = SampleBilinear(image, c, place.Plane(0)[i], place.Plane(1)[i]);
    }
  }
  return out;
}

}  // namespace color3d
