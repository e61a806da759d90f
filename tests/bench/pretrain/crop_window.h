// Parts of a photo: a parallelogram in it that becomes a square picture. Pure functions,
// thread-safe.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/image.h"
#include "core/base/random.h"

namespace color3d {

struct BytePhoto {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> data;  // planar RGB
};

struct WindowOptions {
  double min_area = 0.3;        // of the photo
  double max_aspect = 4.0 / 3;  // before it is made square
  double max_turn = 0.0;        // radians either way
  double mirror_probability = 0.5;
};

// (u, v) in 0..1 of the square picture shows the photo at origin + u across + v down, in px with
// the photo's corner at 0.
struct CropWindow {
  std::array<double, 2> origin;
  std::array<double, 2> across;
  std::array<double, 2> down;

  bool Mirrored() const { return across[0] * down[1] < across[1] * down[0]; }
  std::array<double, 2> At(double u, double v) const;
  // (u, v) of a point of the photo, also outside of the window.
  std::array<double, 2> Inverse(const std::array<double, 2>& point) const;
};

// Inside the photo.
CropWindow RandomWindow(const BytePhoto& photo, const WindowOptions& options, Random& random);

// The window as a picture of 3 channels in 0..1, size_px x size_px.
Image SampleWindow(const BytePhoto& photo, const CropWindow& window, int size_px);

}  // namespace color3d
