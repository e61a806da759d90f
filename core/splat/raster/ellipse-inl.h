// The exact footprint {alpha >= 1/255} of a splat: an ellipse, and its extent inside a band of
// rows, sixteen at a time. Internal to the kernels; compiled once per instruction set.
#if defined(COLOR3D_SPLAT_ELLIPSE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef COLOR3D_SPLAT_ELLIPSE_INL
#undef COLOR3D_SPLAT_ELLIPSE_INL
#else
#define COLOR3D_SPLAT_ELLIPSE_INL
#endif

#include "core/simd/simd-inl.h"
#include "core/splat/raster/raster_constants.h"

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {

using simd::F32;

struct Ellipse {
  F32 slope, inv_y, width2, tau;  // e^2 <= (tau - inv_y dy^2) * width2 inside
  F32 y_reach;                    // half height
  F32 dy_right;                   // row offset of the rightmost point; the leftmost is at -dy_right
};

// From the splat's columns kInvX, kSlope, kInvY, kLog2Opacity (projection.h).
HWY_INLINE Ellipse MakeEllipse(F32 inv_x, F32 slope, F32 inv_y, F32 log2_opacity) {
  Ellipse e;
  e.slope = slope;
  e.inv_y = inv_y;
  e.width2 = simd::Reciprocal(inv_x);
  e.tau = simd::Max(log2_opacity + (1e-4f - kLog2MinAlpha), simd::Zero());
  const F32 var_y = simd::Reciprocal(inv_y);
  const F32 var_x = e.width2 + slope * slope * var_y;
  e.y_reach = simd::FastSqrt(e.tau * var_y);
  e.dy_right = slope * var_y * simd::FastSqrt(e.tau * simd::Reciprocal(var_x));
  return e;
}

// Extent [left, right] in x relative to the centre over the rows low <= dy <= high. Meaningful when
// the band meets [-y_reach, y_reach].
HWY_INLINE void BandExtent(const Ellipse& e, F32 low, F32 high, F32* left, F32* right) {
  const F32 zero = simd::Zero();
  low = simd::Max(low, -e.y_reach);
  high = simd::Min(high, e.y_reach);
  const F32 dr = simd::Clamp(e.dy_right, low, high);
  const F32 dl = simd::Clamp(-e.dy_right, low, high);
  *right = e.slope * dr + simd::FastSqrt(simd::Max(e.tau - e.inv_y * dr * dr, zero) * e.width2) +
           kBoundSlackPx;
  *left = e.slope * dl - simd::FastSqrt(simd::Max(e.tau - e.inv_y * dl * dl, zero) * e.width2) -
          kBoundSlackPx;
}

}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#endif  // COLOR3D_SPLAT_ELLIPSE_INL
