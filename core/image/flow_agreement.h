// Forward-backward consistency of optical flow. Stateless.
#pragma once

namespace color3d {

// Flow (x, y) of a pixel and the backward flow at its destination, px: equation 5 of Sundaram, Brox
// and Keutzer 2010.
inline bool FlowAgrees(double x, double y, double back_x, double back_y) {
  const double gap = (x + back_x) * (x + back_x) + (y + back_y) * (y + back_y);
  const double lengths = x * x + y * y + back_x * back_x + back_y * back_y;
  return gap < 0.01 * lengths + 0.5;
}

}  // namespace color3d
