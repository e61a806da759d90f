// The chain from a Gaussian's parameters to its 2D conic for sixteen Gaussians, shared by the
// forward and the backward pass (which recomputes it: cheaper than memory). Internal to the
// kernels; compiled once per instruction set.
#if defined(COLOR3D_SPLAT_PROJECTION_MATH_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef COLOR3D_SPLAT_PROJECTION_MATH_INL
#undef COLOR3D_SPLAT_PROJECTION_MATH_INL
#else
#define COLOR3D_SPLAT_PROJECTION_MATH_INL
#endif

#include "core/simd/simd-inl.h"
#include "core/splat/raster/projection.h"
#include "core/splat/raster/raster_constants.h"

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {

using simd::Broadcast;
using simd::F32;
using simd::Mask;

inline constexpr float kHalfLog2E = 0.72134752f;
inline constexpr float kLog2E = 1.44269504f;

struct Projected {
  F32 x, y, z;  // camera frame
  F32 inv_z;
  F32 rx, ry;           // x/z, y/z clamped for the Jacobian
  Mask free_x, free_y;  // not clamped
  F32 q[4];             // normalised
  F32 inv_norm;         // of the raw quaternion
  F32 r[9];             // world rotation of the Gaussian
  F32 s[3];             // scales
  Mask free_s[3];       // log scale inside its limits
  F32 u[6];             // J * W, 2x3
  F32 ur[6];            // J * W * R
  F32 m[6];             // J * W * R * S, shrunk
  F32 shrink;
  F32 xx, xy, yy;                   // 2D covariance with dilation
  F32 inv_var_x, slope, inv_var_y;  // 1/var(x|y), cov/var(y), 1/var(y)
  F32 px, py;                       // centre, px
  F32 log2_opacity;
  F32 one_minus_opacity;
};

// R from a unit quaternion (w, x, y, z), row-major.
HWY_INLINE void RotationFromQuaternion(const F32* q, F32* r) {
  const F32 w = q[0], x = q[1], y = q[2], z = q[3];
  r[0] = 1.0f - 2.0f * (y * y + z * z);
  r[1] = 2.0f * (x * y - w * z);
  r[2] = 2.0f * (x * z + w * y);
  r[3] = 2.0f * (x * y + w * z);
  r[4] = 1.0f - 2.0f * (x * x + z * z);
  r[5] = 2.0f * (y * z - w * x);
  r[6] = 2.0f * (x * z - w * y);
  r[7] = 2.0f * (y * z + w * x);
  r[8] = 1.0f - 2.0f * (x * x + y * y);
}

HWY_INLINE void LoadShape(const ParameterBlock& p, int64_t i, Projected& g) {
  F32 norm2 = Broadcast(1e-24f), sum = Broadcast(0.0f);
  for (int k = 0; k < 4; ++k) {
    g.q[k] = simd::Load(p.Row(kRotationRow + k) + i);
    sum = sum + simd::Max(g.q[k], -g.q[k]);
  }
  // The square of a huge quaternion would overflow.
  const F32 reduce =
      simd::Select(simd::Less(Broadcast(1e15f), sum), Broadcast(1e-20f), Broadcast(1.0f));
  for (int k = 0; k < 4; ++k) {
    g.q[k] = g.q[k] * reduce;
    norm2 = norm2 + g.q[k] * g.q[k];
  }
  g.inv_norm = 1.0f / simd::Sqrt(norm2);
  for (int k = 0; k < 4; ++k) g.q[k] = g.q[k] * g.inv_norm;
  g.inv_norm = g.inv_norm * reduce;
  RotationFromQuaternion(g.q, g.r);
  const F32 low = Broadcast(kMinLogScale), high = Broadcast(kMaxLogScale);
  for (int k = 0; k < 3; ++k) {
    const F32 log_scale = simd::Load(p.Row(kLogScaleRow + k) + i);
    g.free_s[k] = simd::And(simd::GreaterEqual(log_scale, low), simd::Less(log_scale, high));
    g.s[k] = simd::Exp2(simd::Clamp(log_scale, low, high) * kLog2E);
  }
}

// log2 sigmoid(x) = -log2(1 + exp(-x)); exact enough where alpha >= 1/255 can happen.
HWY_INLINE void LoadOpacity(const ParameterBlock& p, int64_t i, Projected& g) {
  const F32 logit = simd::Load(p.Row(kOpacityRow) + i);
  const F32 e = simd::Exp2(simd::Clamp(logit * -kLog2E, Broadcast(-100.0f), Broadcast(100.0f)));
  g.log2_opacity = -simd::Log2(1.0f + e);
  g.one_minus_opacity = e / (1.0f + e);
}

HWY_INLINE void LoadCenter(const ParameterBlock& p,
                           const RasterCamera& c,
                           int64_t i,
                           Projected& g) {
  const F32 wx = simd::Load(p.Row(kPositionRow) + i);
  const F32 wy = simd::Load(p.Row(kPositionRow + 1) + i);
  const F32 wz = simd::Load(p.Row(kPositionRow + 2) + i);
  const float* r = c.rotation;
  g.x = r[0] * wx + r[1] * wy + r[2] * wz + c.translation[0];
  g.y = r[3] * wx + r[4] * wy + r[5] * wz + c.translation[1];
  g.z = r[6] * wx + r[7] * wy + r[8] * wz + c.translation[2];
  // Behind the near plane nothing is drawn; a safe depth keeps the lane finite.
  const F32 near = Broadcast(kNearPlane);
  g.inv_z = 1.0f / simd::Max(g.z, near);
  const F32 tx = g.x * g.inv_z, ty = g.y * g.inv_z;
  g.px = c.fx * tx + c.cx;
  g.py = c.fy * ty + c.cy;
  const float margin_x = kFrustumMargin * 0.5f * static_cast<float>(c.width) / c.fx;
  const float margin_y = kFrustumMargin * 0.5f * static_cast<float>(c.height) / c.fy;
  const F32 low_x = Broadcast(-c.cx / c.fx - margin_x);
  const F32 high_x = Broadcast((static_cast<float>(c.width) - c.cx) / c.fx + margin_x);
  const F32 low_y = Broadcast(-c.cy / c.fy - margin_y);
  const F32 high_y = Broadcast((static_cast<float>(c.height) - c.cy) / c.fy + margin_y);
  g.free_x = simd::And(simd::GreaterEqual(tx, low_x), simd::Less(tx, high_x));
  g.free_y = simd::And(simd::GreaterEqual(ty, low_y), simd::Less(ty, high_y));
  g.rx = simd::Clamp(tx, low_x, high_x);
  g.ry = simd::Clamp(ty, low_y, high_y);
}

// cov = M M' + 0.3 I with M = J W R S (2x3); det from the Lagrange identity, all terms positive.
HWY_INLINE void ComputeConic(const RasterCamera& c, Projected& g) {
  const float* w = c.rotation;
  const F32 jx = c.fx * g.inv_z, jy = c.fy * g.inv_z;
  for (int k = 0; k < 3; ++k) {
    g.u[k] = jx * (w[k] - g.rx * w[6 + k]);
    g.u[3 + k] = jy * (w[3 + k] - g.ry * w[6 + k]);
  }
  F32 trace = Broadcast(0.0f);
  for (int row = 0; row < 6; row += 3) {
    for (int k = 0; k < 3; ++k) {
      g.ur[row + k] = g.u[row] * g.r[k] + g.u[row + 1] * g.r[3 + k] + g.u[row + 2] * g.r[6 + k];
      g.m[row + k] = g.ur[row + k] * g.s[k];
      trace = trace + g.m[row + k] * g.m[row + k];
    }
  }
  const F32 limit = Broadcast(kMaxSplatVariancePx2);
  g.shrink = simd::Select(
      simd::Less(limit, trace), simd::Sqrt(limit / simd::Max(trace, limit)), Broadcast(1.0f));
  for (int k = 0; k < 6; ++k) g.m[k] = g.m[k] * g.shrink;
  const F32* m = g.m;
  const F32 n0 = m[0] * m[0] + m[1] * m[1] + m[2] * m[2];
  const F32 n1 = m[3] * m[3] + m[4] * m[4] + m[5] * m[5];
  const F32 cross_x = m[1] * m[5] - m[2] * m[4];
  const F32 cross_y = m[2] * m[3] - m[0] * m[5];
  const F32 cross_z = m[0] * m[4] - m[1] * m[3];
  const F32 det = cross_x * cross_x + cross_y * cross_y + cross_z * cross_z +
                  kCovarianceDilation * (n0 + n1) + kCovarianceDilation * kCovarianceDilation;
  g.xx = n0 + kCovarianceDilation;
  g.yy = n1 + kCovarianceDilation;
  g.xy = m[0] * m[3] + m[1] * m[4] + m[2] * m[5];
  g.inv_var_x = g.yy / det;
  g.inv_var_y = 1.0f / g.yy;
  g.slope = g.xy * g.inv_var_y;
}

// Unit direction from the camera to the Gaussian, and 1 / distance.
HWY_INLINE void ViewDirection(
    const ParameterBlock& p, const RasterCamera& c, int64_t i, F32* direction, F32* inv_distance) {
  F32 n2 = Broadcast(1e-24f);
  for (int k = 0; k < 3; ++k) {
    direction[k] = simd::Load(p.Row(kPositionRow + k) + i) - c.center[k];
    n2 = n2 + direction[k] * direction[k];
  }
  *inv_distance = 1.0f / simd::Sqrt(n2);
  for (int k = 0; k < 3; ++k) direction[k] = direction[k] * *inv_distance;
}

}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#endif  // COLOR3D_SPLAT_PROJECTION_MATH_INL
