#include "core/scene/camera.h"

#include <algorithm>
#include <cmath>

namespace color3d {

Camera Camera::Scaled(int new_width, int new_height) const {
  // Pixel coordinates start at the corner of the upper left pixel, so they scale without offset.
  const double sx = static_cast<double>(new_width) / width;
  const double sy = static_cast<double>(new_height) / height;
  return {new_width, new_height, fx * sx, fy * sy, cx * sx, cy * sy};
}

Camera Camera::FitWithin(int max_side_px) const {
  const int side = std::max(width, height);
  if (max_side_px <= 0 || side <= max_side_px) return *this;
  // Rounds as FitWithin(Image).
  const double scale = static_cast<double>(max_side_px) / side;
  return Scaled(std::max(1, static_cast<int>(std::lround(width * scale))),
                std::max(1, static_cast<int>(std::lround(height * scale))));
}

}  // namespace color3d
