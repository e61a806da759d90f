#include "core/splat/training/regularize.h"

#include "core/simd/instruction_set.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/splat/training/regularize.cc"
#include <hwy/foreach_target.h>

#include "core/splat/raster/projection_math-inl.h"

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

// Sixteen approximately standard normal numbers: the sum of the four bytes of a hash.
F32 HashNormal(uint32_t seed, int64_t first) {
  namespace hn = hwy::HWY_NAMESPACE;
  const hn::RebindToUnsigned<simd::FloatTag> d;
  const hn::RebindToSigned<simd::FloatTag> di;
  F32 r;
  for (int k = 0; k < simd::kParts; ++k) {
    auto x = hn::Iota(d, static_cast<uint32_t>(first) + k * simd::kRegisterLanes);
    x = hn::Add(hn::Mul(x, hn::Set(d, 0x9E3779B1u)), hn::Set(d, seed));
    x = hn::Xor(x, hn::ShiftRight<16>(x));
    x = hn::Mul(x, hn::Set(d, 0x85EBCA6Bu));
    x = hn::Xor(x, hn::ShiftRight<13>(x));
    x = hn::Mul(x, hn::Set(d, 0xC2B2AE35u));
    x = hn::Xor(x, hn::ShiftRight<16>(x));
    const auto byte = hn::Set(d, 255u);
    const auto low = hn::Add(hn::And(x, byte), hn::And(hn::ShiftRight<8>(x), byte));
    const auto high = hn::Add(hn::And(hn::ShiftRight<16>(x), byte), hn::ShiftRight<24>(x));
    r.part[k] = hn::ConvertTo(simd::FloatTag(), hn::BitCast(di, hn::Add(low, high)));
  }
  return (r - 510.0f) * (1.0f / 147.80f);  // sqrt(4 (256^2 - 1) / 12)
}

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

void NoiseRange(
    float strength, uint32_t seed, int64_t begin, int64_t end, ParameterBlock& parameters) {
  for (int64_t i = begin; i < end; i += simd::kLanes) {
    Projected g;
    LoadOpacity(parameters, i, g);
    const F32 opacity = 1.0f - g.one_minus_opacity;
    // Solid Gaussians do not move: sigmoid(100 (0.005 - 0.1)) < 1e-4.
    const Mask faint = simd::Less(opacity, Broadcast(0.1f));
    if (!simd::Any(faint)) continue;
    LoadShape(parameters, i, g);
    const F32 gate = 1.0f / (1.0f + simd::Exp2((opacity - 0.005f) * (100.0f * kLog2E)));
    F32 local[3] = {simd::Zero(), simd::Zero(), simd::Zero()};
    for (int k = 0; k < 3; ++k) {
      const F32 eta = HashNormal(seed + static_cast<uint32_t>(k) * 0x68E31DA4u, i);
      for (int j = 0; j < 3; ++j) local[j] = local[j] + g.r[3 * k + j] * eta;
    }
    for (int j = 0; j < 3; ++j) local[j] = local[j] * g.s[j] * g.s[j];
    for (int k = 0; k < 3; ++k) {
      float* p = parameters.Row(kPositionRow + k) + i;
      const F32 move =
          g.r[3 * k] * local[0] + g.r[3 * k + 1] * local[1] + g.r[3 * k + 2] * local[2];
      simd::Store(p, simd::Load(p) + simd::SelectOrZero(faint, strength * gate * move));
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
HWY_EXPORT(NoiseRange);
}  // namespace

void AddPenaltyGradients(const ParameterBlock& parameters,
                         float opacity_penalty,
                         float scale_penalty,
                         ThreadPool& pool,
                         ParameterBlock& gradient) {
  const float count = static_cast<float>(parameters.count());
  const float opacity_each = opacity_penalty / count, scale_each = scale_penalty / (3.0f * count);
  const auto penalty_range = &COLOR3D_KERNEL(PenaltyRange);
  pool.ForRanges((parameters.count() + 15) / 16, [&](int64_t begin, int64_t end, int) {
    penalty_range(parameters, opacity_each, scale_each, begin * 16, end * 16, gradient);
  });
}

void LimitNeedles(float max_log_ratio, ThreadPool& pool, ParameterBlock& parameters) {
  const auto needle_range = &COLOR3D_KERNEL(NeedleRange);
  pool.ForRanges((parameters.count() + 15) / 16, [&](int64_t begin, int64_t end, int) {
    needle_range(max_log_ratio, begin * 16, end * 16, parameters);
  });
}

void AddPositionNoise(float strength, uint32_t seed, ThreadPool& pool, ParameterBlock& parameters) {
  const auto noise_range = &COLOR3D_KERNEL(NoiseRange);
  pool.ForRanges((parameters.count() + 15) / 16, [&](int64_t begin, int64_t end, int) {
    noise_range(strength, seed, begin * 16, end * 16, parameters);
  });
}

}  // namespace color3d
#endif  // HWY_ONCE
