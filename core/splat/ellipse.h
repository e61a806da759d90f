// The exact footprint {alpha >= 1/255} of a splat: an ellipse, and its extent inside a band of
// rows. Generic in the number type (float, or sixteen floats). Internal to the kernels.
#pragma once

#include "core/splat/simd.h"

namespace color3d::splat_internal {

inline constexpr float kLog2Of255 = 7.9943534f;
// Bounds are widened by this much against rounding; the pixel test itself decides.
inline constexpr float kBoundSlackPx = 0.02f;

template <class V>
struct Ellipse {
  V slope, inv_y, width2, tau;  // e^2 <= (tau - inv_y dy^2) * width2 inside
  V y_reach;                    // half height
  V dy_right;                   // row offset of the rightmost point; the leftmost is at -dy_right
};

// From the splat's columns kInvX, kSlope, kInvY, kLog2Opacity (projection.h).
template <class V>
inline Ellipse<V> MakeEllipse(V inv_x, V slope, V inv_y, V log2_opacity) {
  Ellipse<V> e;
  e.slope = slope;
  e.inv_y = inv_y;
  e.width2 = 1.0f / inv_x;
  e.tau = simd::Max(log2_opacity + (kLog2Of255 + 1e-4f), inv_x * 0.0f);
  const V var_y = 1.0f / inv_y;
  const V var_x = e.width2 + slope * slope * var_y;
  e.y_reach = simd::Sqrt(e.tau * var_y);
  e.dy_right = slope * var_y * simd::Sqrt(e.tau / var_x);
  return e;
}

// Extent [left, right] in x relative to the centre over the rows low <= dy <= high. Meaningful when
// the band meets [-y_reach, y_reach].
template <class V>
inline void BandExtent(const Ellipse<V>& e, V low, V high, V* left, V* right) {
  const V zero = e.tau * 0.0f;
  low = simd::Max(low, zero - e.y_reach);
  high = simd::Min(high, e.y_reach);
  const V dr = simd::Clamp(e.dy_right, low, high);
  const V dl = simd::Clamp(zero - e.dy_right, low, high);
  *right = e.slope * dr + simd::Sqrt(simd::Max(e.tau - e.inv_y * dr * dr, zero) * e.width2) +
           kBoundSlackPx;
  *left = e.slope * dl - simd::Sqrt(simd::Max(e.tau - e.inv_y * dl * dl, zero) * e.width2) -
          kBoundSlackPx;
}

}  // namespace color3d::splat_internal
