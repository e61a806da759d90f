#include "core/splat/raster/projection.h"

#include <algorithm>

#include "core/base/flush_to_zero.h"
#include "core/simd/instruction_set.h"
#include "core/splat/model/spherical_harmonics.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/splat/raster/projection.cc"
#include <hwy/foreach_target.h>

#include "core/splat/raster/projection_math-inl.h"

#ifndef COLOR3D_SPLAT_PROJECTION_ONCE
#define COLOR3D_SPLAT_PROJECTION_ONCE
namespace color3d {
namespace {

constexpr int64_t kPrefetchBlocks = 2;  // ahead

struct ForwardContext {
  const ParameterBlock& p;
  const ColorSpec& color;
  bool depth_channel;
  const RasterCamera& camera;
  SplatBuffer& splats;
};

struct BackwardContext {
  int row_floats;  // of a pair's gradient
  int columns;     // of them used
  const ParameterBlock& p;
  const ColorSpec& color;
  const RasterCamera& camera;
  const SplatBuffer& splats;
  const float* pair_gradient;
  const uint32_t* first_pair;
  GradientScope scope;
  ParameterBlock& gradient;
  DensifyStatistics* statistics;
};

}  // namespace
}  // namespace color3d
#endif  // COLOR3D_SPLAT_PROJECTION_ONCE

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

#include "core/splat/model/spherical_harmonics-inl.h"

// Lanes of [i, i + 16) that exist and contribute to the picture.
Mask VisibleLanes(const RasterCamera& c, const Projected& g, int64_t i, int64_t count) {
  const float rest = static_cast<float>(std::min<int64_t>(count - i, simd::kLanes));
  Mask visible = simd::Less(simd::LaneIndex(), Broadcast(rest));
  visible = simd::And(visible, simd::Less(Broadcast(kNearPlane), g.z));
  // tau: the exponent (base 2) that is left above alpha = 1/255.
  const F32 tau = g.log2_opacity - kLog2MinAlpha;
  visible = simd::And(visible, simd::Less(Broadcast(0.0f), tau));
  const F32 reach = simd::Max(tau, Broadcast(0.0f)) * (1.0f / kHalfLog2E);
  const F32 ex = simd::Sqrt(reach * g.xx), ey = simd::Sqrt(reach * g.yy);
  visible = simd::And(visible, simd::Less(Broadcast(0.0f), g.px + ex));
  visible = simd::And(visible, simd::Less(g.px - ex, Broadcast(static_cast<float>(c.width))));
  visible = simd::And(visible, simd::Less(Broadcast(0.0f), g.py + ey));
  visible = simd::And(visible, simd::Less(g.py - ey, Broadcast(static_cast<float>(c.height))));
  // Comparisons are false for NaN; infinite centres or depths are refused here.
  const F32 huge = Broadcast(1e9f);
  visible = simd::And(visible, simd::Less(g.z, huge));
  visible = simd::And(visible, simd::Less(g.px * g.px + g.py * g.py, huge * huge));
  return visible;
}

int MaxCoefficients(const ColorSpec& color) {
  int n = 1;
  for (int c = 0; c < color.channels; ++c) n = std::max(n, color.channel[c].coefficients);
  return n;
}

F32 ShSum(const ParameterBlock& p, const ColorChannel& channel, const F32* basis, int64_t i) {
  F32 sum = Broadcast(channel.base);
  for (int k = 0; k < channel.coefficients; ++k) {
    sum = sum + basis[k] * simd::Load(p.Row(channel.row + k) + i);
  }
  return sum;
}

void ProjectSixteen(const ForwardContext& ctx, int64_t i) {
  const ParameterBlock& p = ctx.p;
  const RasterCamera& camera = ctx.camera;
  Projected g;
  LoadCenter(p, camera, i, g);
  LoadShape(p, i, g);
  LoadOpacity(p, i, g);
  ComputeConic(camera, g);
  const uint32_t bits = simd::MaskBits(VisibleLanes(camera, g, i, p.count()));
  const int lanes = static_cast<int>(std::min<int64_t>(p.count() - i, simd::kLanes));
  uint32_t* keys = ctx.splats.depth_key.data() + i;
  if (bits == 0) {
    std::fill_n(keys, lanes, 0u);
    return;
  }
  alignas(64) float columns[12][simd::kLanes];
  simd::Store(columns[kU], g.px);
  simd::Store(columns[kV], g.py);
  simd::Store(columns[kInvX], g.inv_var_x * kHalfLog2E);
  simd::Store(columns[kSlope], g.slope);
  simd::Store(columns[kInvY], g.inv_var_y * kHalfLog2E);
  simd::Store(columns[kLog2Opacity], g.log2_opacity);
  F32 direction[3], inv_distance, basis[kMaxShCoefficients];
  ViewDirection(p, camera, i, direction, &inv_distance);
  EvaluateSh(MaxCoefficients(ctx.color), direction[0], direction[1], direction[2], basis);
  const int channels = ctx.color.channels;
  for (int c = 0; c < channels; ++c) {
    const ColorChannel& channel = ctx.color.channel[c];
    const F32 value = ShSum(p, channel, basis, i);
    simd::Store(columns[kSplatColor + c],
                channel.clamp_at_zero ? simd::Max(value, simd::Zero()) : value);
  }
  if (ctx.depth_channel) simd::Store(columns[kSplatColor + channels], g.z);
  const int used = kSplatColor + ctx.splats.channels, row_floats = ctx.splats.row_floats;
  alignas(64) int32_t depth_bits[simd::kLanes];
  simd::Store(depth_bits, simd::BitsOf(g.z));
  for (int lane = 0; lane < lanes; ++lane) {
    const bool visible = (bits >> lane & 1u) != 0;
    keys[lane] = visible ? static_cast<uint32_t>(depth_bits[lane]) : 0u;
    if (!visible) continue;
    float* row = ctx.splats.rows.data() + (i + lane) * row_floats;
    for (int k = 0; k < used; ++k) row[k] = columns[k][lane];
  }
}

// dL/d(covariance) to dL/dM, in place of M's gradient `dm` (2x3).
void ConicBackward(const Projected& g, const F32* sums, F32* dm, F32* d_center) {
  const F32 d_inv_x = -0.5f * sums[kSumWEE];
  const F32 d_inv_y = -0.5f * sums[kSumWDyDy];
  const F32 d_slope = g.inv_var_x * sums[kSumWEDy];
  d_center[0] = g.inv_var_x * sums[kSumWE];
  d_center[1] = g.inv_var_y * sums[kSumWDy] - g.slope * d_center[0];
  // 1/var(x|y) = (xx - xy^2 / yy)^-1, slope = xy / yy, 1/var(y) = 1 / yy.
  const F32 dxx = -g.inv_var_x * g.inv_var_x * d_inv_x;
  const F32 dxy = g.inv_var_y * d_slope - 2.0f * g.slope * dxx;
  const F32 dyy =
      g.slope * g.slope * dxx - g.inv_var_y * (g.slope * d_slope + g.inv_var_y * d_inv_y);
  for (int k = 0; k < 3; ++k) {
    dm[k] = (2.0f * dxx * g.m[k] + dxy * g.m[3 + k]) * g.shrink;
    dm[3 + k] = (dxy * g.m[k] + 2.0f * dyy * g.m[3 + k]) * g.shrink;
  }
}

// dL/d(raw quaternion) from dL/dR; R is quadratic in the unit quaternion.
void QuaternionBackward(const Projected& g, const F32* dr, F32* dq) {
  const F32 w = g.q[0], x = g.q[1], y = g.q[2], z = g.q[3];
  F32 d[4];
  d[0] = 2.0f * (x * (dr[7] - dr[5]) + y * (dr[2] - dr[6]) + z * (dr[3] - dr[1]));
  d[1] = 2.0f * (y * (dr[1] + dr[3]) + z * (dr[2] + dr[6]) + w * (dr[7] - dr[5]) -
                 2.0f * x * (dr[4] + dr[8]));
  d[2] = 2.0f * (x * (dr[1] + dr[3]) + z * (dr[5] + dr[7]) + w * (dr[2] - dr[6]) -
                 2.0f * y * (dr[0] + dr[8]));
  d[3] = 2.0f * (x * (dr[2] + dr[6]) + y * (dr[5] + dr[7]) + w * (dr[3] - dr[1]) -
                 2.0f * z * (dr[0] + dr[4]));
  const F32 dot = d[0] * w + d[1] * x + d[2] * y + d[3] * z;
  for (int k = 0; k < 4; ++k) dq[k] = (d[k] - g.q[k] * dot) * g.inv_norm;
}

struct ShapeGradient {
  F32 position[3];
  F32 log_scale[3];
  F32 rotation[4];
};

ShapeGradient ShapeBackward(const RasterCamera& c, const Projected& g, const F32* sums) {
  ShapeGradient out;
  F32 dm[6], d_center[2];
  ConicBackward(g, sums, dm, d_center);
  F32 dr[9], du[6];
  for (int k = 0; k < 3; ++k) {
    const F32 ds = dm[k] * g.ur[k] + dm[3 + k] * g.ur[3 + k];
    out.log_scale[k] = simd::SelectOrZero(g.free_s[k], ds * g.s[k]);
    dm[k] = dm[k] * g.s[k];  // now dL/d(J W R)
    dm[3 + k] = dm[3 + k] * g.s[k];
  }
  for (int j = 0; j < 3; ++j) {
    for (int k = 0; k < 3; ++k) dr[3 * j + k] = g.u[j] * dm[k] + g.u[3 + j] * dm[3 + k];
    du[j] = dm[0] * g.r[3 * j] + dm[1] * g.r[3 * j + 1] + dm[2] * g.r[3 * j + 2];
    du[3 + j] = dm[3] * g.r[3 * j] + dm[4] * g.r[3 * j + 1] + dm[5] * g.r[3 * j + 2];
  }
  QuaternionBackward(g, dr, out.rotation);
  // J = [fx/z, 0, -fx rx/z; 0, fy/z, -fy ry/z]; U = J W.
  const float* w = c.rotation;
  const F32 dj00 = du[0] * w[0] + du[1] * w[1] + du[2] * w[2];
  const F32 dj02 = du[0] * w[6] + du[1] * w[7] + du[2] * w[8];
  const F32 dj11 = du[3] * w[3] + du[4] * w[4] + du[5] * w[5];
  const F32 dj12 = du[3] * w[6] + du[4] * w[7] + du[5] * w[8];
  const F32 jx = c.fx * g.inv_z, jy = c.fy * g.inv_z;
  const F32 d_rx = -jx * dj02, d_ry = -jy * dj12;
  F32 d_tx = simd::SelectOrZero(g.free_x, d_rx) + c.fx * d_center[0];
  F32 d_ty = simd::SelectOrZero(g.free_y, d_ry) + c.fy * d_center[1];
  const F32 dx = d_tx * g.inv_z, dy = d_ty * g.inv_z;
  const F32 dz = -g.inv_z * (d_tx * g.x * g.inv_z + d_ty * g.y * g.inv_z +
                             jx * (dj00 - g.rx * dj02) + jy * (dj11 - g.ry * dj12));
  for (int k = 0; k < 3; ++k) out.position[k] = w[k] * dx + w[3 + k] * dy + w[6 + k] * dz;
  return out;
}

// Adds up the pairs of sixteen Gaussians into planar sums. False when none is visible.
bool GatherSums(const BackwardContext& ctx, int64_t i, int lanes, F32* sums) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::FixedTag<float, 4> d;
  const int row_floats = ctx.row_floats, used = ctx.columns;
  if (ctx.first_pair[i + lanes] == ctx.first_pair[i]) return false;
  alignas(64) float planar[12][simd::kLanes] = {};
  for (int lane = 0; lane < lanes; ++lane) {
    auto sum0 = hn::Zero(d), sum1 = sum0, sum2 = sum0;
    const float* row =
        ctx.pair_gradient + static_cast<size_t>(ctx.first_pair[i + lane]) * row_floats;
    const float* end =
        ctx.pair_gradient + static_cast<size_t>(ctx.first_pair[i + lane + 1]) * row_floats;
    for (; row != end; row += row_floats) {
      sum0 = hn::Add(sum0, hn::Load(d, row));
      sum1 = hn::Add(sum1, hn::Load(d, row + 4));
      if (row_floats > 8) sum2 = hn::Add(sum2, hn::Load(d, row + 8));
    }
    alignas(16) float sum[12];
    hn::Store(sum0, d, sum);
    hn::Store(sum1, d, sum + 4);
    hn::Store(sum2, d, sum + 8);
    for (int k = 0; k < used; ++k) planar[k][lane] = sum[k];
  }
  for (int k = 0; k < used; ++k) sums[k] = simd::Load(planar[k]);
  return true;
}

// Lanes that are not visible hold arbitrary geometry; their sums are zero, but 0 * inf is not.
Mask Drawn(const BackwardContext& ctx, int64_t i) {
  const int lanes = static_cast<int>(std::min<int64_t>(ctx.p.count() - i, simd::kLanes));
  float seen[simd::kLanes] = {};
  for (int lane = 0; lane < lanes; ++lane) {
    seen[lane] = ctx.splats.depth_key[i + lane] != 0 ? 1.0f : 0.0f;
  }
  return simd::Less(Broadcast(0.5f), simd::Load(seen));
}

// Colour gradients, and the part of dL/d(position) that comes through the view direction.
void ColorBackward(
    const BackwardContext& ctx, int64_t i, Mask drawn, const F32* sums, F32* d_position) {
  F32 direction[3], inv_distance, basis[kMaxShCoefficients], weight[kMaxShCoefficients];
  ViewDirection(ctx.p, ctx.camera, i, direction, &inv_distance);
  for (F32& d : direction) d = simd::SelectOrZero(drawn, d);
  const int most = MaxCoefficients(ctx.color);
  EvaluateSh(most, direction[0], direction[1], direction[2], basis);
  for (int k = 0; k < most; ++k) weight[k] = Broadcast(0.0f);
  for (int c = 0; c < ctx.color.channels; ++c) {
    const ColorChannel& channel = ctx.color.channel[c];
    F32 d = sums[kGradientColor + c];
    if (channel.clamp_at_zero) {
      d = simd::SelectOrZero(simd::Less(Broadcast(0.0f), ShSum(ctx.p, channel, basis, i)), d);
    }
    for (int k = 0; k < channel.coefficients; ++k) {
      weight[k] = weight[k] + d * simd::Load(ctx.p.Row(channel.row + k) + i);
      simd::Store(ctx.gradient.Row(channel.row + k) + i, d * basis[k]);
    }
  }
  if (ctx.scope == GradientScope::kColorOnly || most == 1) return;
  F32 d_direction[3];
  ShGradient(most, direction[0], direction[1], direction[2], weight, d_direction);
  const F32 radial =
      d_direction[0] * direction[0] + d_direction[1] * direction[1] + d_direction[2] * direction[2];
  for (int k = 0; k < 3; ++k) {
    d_position[k] = d_position[k] + (d_direction[k] - radial * direction[k]) * inv_distance;
  }
}

void UpdateStatistics(const BackwardContext& ctx, int64_t i, const Projected& g, const F32* sums) {
  DensifyStatistics& s = *ctx.statistics;
  const F32 du = g.inv_var_x * sums[kSumWE];
  const F32 dv = g.inv_var_y * sums[kSumWDy] - g.slope * du;
  const F32 nx = du * (0.5f * static_cast<float>(ctx.camera.width));
  const F32 ny = dv * (0.5f * static_cast<float>(ctx.camera.height));
  alignas(64) float norm[simd::kLanes], radius[simd::kLanes];
  simd::Store(norm, simd::Sqrt(nx * nx + ny * ny));
  simd::Store(radius,
              simd::Sqrt(simd::Max(g.xx, g.yy)) * (1.0f / static_cast<float>(ctx.camera.width)));
  const int lanes = static_cast<int>(std::min<int64_t>(ctx.p.count() - i, simd::kLanes));
  for (int lane = 0; lane < lanes; ++lane) {
    if (ctx.splats.depth_key[i + lane] == 0) continue;
    s.gradient[i + lane] += norm[lane];
    s.count[i + lane] += 1.0f;
    s.radius[i + lane] = std::max(s.radius[i + lane], radius[lane]);
  }
}

// There are more rows than the processor's prefetchers can follow.
void PrefetchRows(const ParameterBlock& p, int64_t i) {
  i = std::min(i, p.stride() - simd::kLanes);
  for (int r = 0; r < p.rows(); ++r) __builtin_prefetch(p.Row(r) + i);
}

void BackwardSixteen(const BackwardContext& ctx, int64_t i) {
  const int lanes = static_cast<int>(std::min<int64_t>(ctx.p.count() - i, simd::kLanes));
  F32 sums[12];
  if (!GatherSums(ctx, i, lanes, sums)) {
    for (int r = 0; r < ctx.p.rows(); ++r) simd::Store(ctx.gradient.Row(r) + i, Broadcast(0.0f));
    return;
  }
  const Mask drawn = Drawn(ctx, i);
  if (ctx.scope == GradientScope::kColorOnly) {
    ColorBackward(ctx, i, drawn, sums, nullptr);
    return;
  }
  Projected g;
  LoadCenter(ctx.p, ctx.camera, i, g);
  LoadShape(ctx.p, i, g);
  LoadOpacity(ctx.p, i, g);
  ComputeConic(ctx.camera, g);
  // The moments' gradients have 1 / variance as factor: that of the Gaussian as it is, not shrunk.
  for (int k = kSumWE; k <= kSumWDyDy; ++k) sums[k] = sums[k] * (g.shrink * g.shrink);
  ShapeGradient shape = ShapeBackward(ctx.camera, g, sums);
  ColorBackward(ctx, i, drawn, sums, shape.position);
  const auto store = [&](int row, F32 value) HWY_ATTR {
    simd::Store(ctx.gradient.Row(row) + i, simd::SelectOrZero(drawn, value));
  };
  for (int k = 0; k < 3; ++k) store(kPositionRow + k, shape.position[k]);
  for (int k = 0; k < 3; ++k) store(kLogScaleRow + k, shape.log_scale[k]);
  for (int k = 0; k < 4; ++k) store(kRotationRow + k, shape.rotation[k]);
  store(kOpacityRow, sums[kSumW] * g.one_minus_opacity);
  if (ctx.statistics != nullptr) UpdateStatistics(ctx, i, g, sums);
}

void ProjectRange(const ForwardContext& ctx, int64_t begin, int64_t end) {
  for (int64_t block = begin; block < end; ++block) {
    PrefetchRows(ctx.p, (block + kPrefetchBlocks) * simd::kLanes);
    ProjectSixteen(ctx, block * simd::kLanes);
  }
}

void BackwardRange(const BackwardContext& ctx, int64_t begin, int64_t end) {
  for (int64_t block = begin; block < end; ++block) {
    PrefetchRows(ctx.p, (block + kPrefetchBlocks) * simd::kLanes);
    PrefetchRows(ctx.gradient, (block + kPrefetchBlocks) * simd::kLanes);
    BackwardSixteen(ctx, block * simd::kLanes);
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace color3d {
namespace {
HWY_EXPORT(ProjectRange);
HWY_EXPORT(BackwardRange);
}  // namespace

void DensifyStatistics::Reset(int64_t gaussians) {
  gradient.assign(static_cast<size_t>(gaussians), 0.0f);
  count.assign(static_cast<size_t>(gaussians), 0.0f);
  radius.assign(static_cast<size_t>(gaussians), 0.0f);
}

void ProjectSplats(const SplatInput& input,
                   bool depth_channel,
                   ThreadPool& pool,
                   SplatBuffer& splats) {
  const size_t count = static_cast<size_t>(input.parameters.count());
  splats.channels = input.color.channels + (depth_channel ? 1 : 0);
  splats.row_floats = SplatRowFloats(splats.channels);
  splats.rows.resize(count * splats.row_floats);
  splats.depth_key.resize(count);
  const ForwardContext ctx{input.parameters, input.color, depth_channel, input.camera, splats};
  const auto project_range = &COLOR3D_KERNEL(ProjectRange);
  pool.ForRanges(input.parameters.blocks(),
                 [&](int64_t begin, int64_t end, int) { project_range(ctx, begin, end); });
}

void ProjectSplatsBackward(const SplatInput& input,
                           const SplatBuffer& splats,
                           const AlignedFloats& pair_gradient,
                           const std::vector<uint32_t>& first_pair,
                           ThreadPool& pool,
                           const GradientOutput& output) {
  const ParameterBlock& parameters = input.parameters;
  if (!output.parameters.HasShapeOf(parameters)) output.parameters = parameters.ZerosOfSameShape();
  const BackwardContext ctx{GradientRowFloats(input.color.channels),
                            kGradientColor + input.color.channels,
                            parameters,
                            input.color,
                            input.camera,
                            splats,
                            pair_gradient.data(),
                            first_pair.data(),
                            output.scope,
                            output.parameters,
                            output.statistics};
  const auto backward_range = &COLOR3D_KERNEL(BackwardRange);
  pool.ForRanges(parameters.blocks(), [&](int64_t begin, int64_t end, int) {
    const ScopedFlushToZero flush;
    backward_range(ctx, begin, end);
  });
}

}  // namespace color3d
#endif  // HWY_ONCE
