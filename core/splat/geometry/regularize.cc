#include "core/splat/geometry/regularize.h"

#include "core/simd/instruction_set.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/splat/geometry/regularize.cc"
#include <hwy/foreach_target.h>

#include "core/splat/raster/projection_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

// Lanes [begin, end), multiples of 16.
void PenaltyRange(const ParameterBlock& parameters,
                  float opacity_each,
                  float scale_each,
                  int64_t begin,
                  int64_t end,
                  ParameterBlock& gradient) {
  for (int64_t i = begin; i < end; i += simd::kLanes) {
    float* g = gradient.Row(kOpacityRow) + i;
    Projected shape;
    LoadOpacity(parameters, i, shape);
    const F32 slope = (1.0f - shape.one_minus_opacity) * shape.one_minus_opacity;
    simd::Store(g, simd::Load(g) + opacity_each * slope);
    for (int k = 0; k < 3; ++k) {
      g = gradient.Row(kLogScaleRow + k) + i;
      const F32 log_scale = simd::Load(parameters.Row(kLogScaleRow + k) + i);
      const F32 scale = simd::Exp2(
          simd::Clamp(log_scale, Broadcast(kMinLogScale), Broadcast(kMaxLogScale)) * kLog2E);
      simd::Store(g, simd::Load(g) + scale_each * scale);
    }
  }
}

void NeedleRange(float max_log_ratio, int64_t begin, int64_t end, ParameterBlock& parameters) {
  for (int64_t i = begin; i < end; i += simd::kLanes) {
    F32 s[3];
    for (int k = 0; k < 3; ++k) s[k] = simd::Load(parameters.Row(kLogScaleRow + k) + i);
    const F32 low = simd::Min(s[0], s[1]), high = simd::Max(s[0], s[1]);
    const F32 middle = simd::Max(low, simd::Min(high, s[2]));
    for (int k = 0; k < 3; ++k) {
      simd::Store(parameters.Row(kLogScaleRow + k) + i, simd::Min(s[k], middle + max_log_ratio));
    }
  }
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace color3d {
namespace {
HWY_EXPORT(PenaltyRange);
HWY_EXPORT(NeedleRange);
}  // namespace

void AddPenaltyGradients(const ParameterBlock& parameters,
                         float opacity_penalty,
                         float scale_penalty,
                         ThreadPool& pool,
                         ParameterBlock& gradient) {
  const float count = static_cast<float>(parameters.count());
  const float opacity_each = opacity_penalty / count, scale_each = scale_penalty / (3.0f * count);
  const auto penalty_range = &COLOR3D_KERNEL(PenaltyRange);
  pool.ForRanges(parameters.blocks(), [&](int64_t begin, int64_t end, int) {
    penalty_range(parameters, opacity_each, scale_each, begin * 16, end * 16, gradient);
  });
}

void LimitNeedles(float max_log_ratio, ThreadPool& pool, ParameterBlock& parameters) {
  const auto needle_range = &COLOR3D_KERNEL(NeedleRange);
  pool.ForRanges(parameters.blocks(), [&](int64_t begin, int64_t end, int) {
    needle_range(max_log_ratio, begin * 16, end * 16, parameters);
  });
}

}  // namespace color3d
#endif  // HWY_ONCE
