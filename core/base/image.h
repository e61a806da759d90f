// Planar float image: the one picture type between modules. Plain value, no sharing.
#pragma once

#include <cstddef>
#include <vector>

namespace color3d {

// Channel c, row y, column x is at data[(c * height + y) * width + x]. The creator of the image
// defines the value range: sRGB in 0..1; Lab with L in 0..100 and a, b in Lab units; a mask.
struct Image {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<float> data;

  Image() = default;
  Image(int width_px, int height_px, int channel_count, float value = 0.0f)
      : width(width_px),
        height(height_px),
        channels(channel_count),
        data(static_cast<size_t>(width_px) * height_px * channel_count, value) {}

  size_t PlaneSize() const { return static_cast<size_t>(width) * height; }
  bool Empty() const { return data.empty(); }
  float* Plane(int c) { return data.data() + PlaneSize() * c; }
  const float* Plane(int c) const { return data.data() + PlaneSize() * c; }
  float& At(int c, int y, int x) { return Plane(c)[static_cast<size_t>(y) * width + x]; }
  float At(int c, int y, int x) const { return Plane(c)[static_cast<size_t>(y) * width + x]; }
};

}  // namespace color3d
