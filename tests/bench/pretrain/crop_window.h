// Crops of a photo: a parallelogram that becomes a square picture. Pure functions, thread-safe.
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
  double min_area = 0.3;        // minimum share of the photo's area
  double max_aspect = 4.0 / 3;  // aspect ratio before resampling to a square
  double max_turn = 0.0;        // maximum rotation, radians
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

// Returns a random window inside the photo.
CropWindow RandomWindow(const BytePhoto& photo, const WindowOptions& options, Random& random);

// Samples the window as a picture of 3 channels in 0..1, size_px x size_px.
Image SampleWindow(const BytePhoto& photo, const CropWindow& window, int size_px);

}  // namespace color3d
