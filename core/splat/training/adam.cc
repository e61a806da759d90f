#include "core/splat/training/adam.h"

#include <atomic>
#include <cmath>

#include "core/base/flush_to_zero.h"
#include "core/simd/instruction_set.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/splat/training/adam.cc"
#include <hwy/foreach_target.h>

#include "core/simd/simd-inl.h"

#ifndef COLOR3D_SPLAT_ADAM_ONCE
#define COLOR3D_SPLAT_ADAM_ONCE
namespace color3d {
namespace {

// One row's step: gradient g, parameter p, moments m and v.
struct RowStep {
  const float* g;
  float* p;
  float* m;
  float* v;
  float beta1;
  float rate;             // divided by the first moment's bias correction
  float root_correction;  // 1 / sqrt of the second moment's
};

}  // namespace
}  // namespace color3d
#endif  // COLOR3D_SPLAT_ADAM_ONCE

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

using simd::F32;

// Blocks [begin, end) of sixteen Gaussians. The result is zero when all is finite (x * 0 is NaN for
// infinities and NaN).
float UpdateRow(const RowStep& s, int64_t begin, int64_t end) {
  F32 poison = simd::Zero();
  for (int64_t i = begin * simd::kLanes; i < end * simd::kLanes; i += simd::kLanes) {
    // Clamped so that its square does not overflow; Adam does not depend on the gradient's size.
    const F32 raw = simd::Load(s.g + i), p = simd::Load(s.p + i);
    const F32 gradient = simd::Clamp(raw, simd::Broadcast(-1e18f), simd::Broadcast(1e18f));
    const F32 m = simd::Load(s.m + i), v = simd::Load(s.v + i);
    const F32 first = m + (1.0f - s.beta1) * (gradient - m);
    const F32 second = v + (1.0f - kAdamBeta2) * (gradient * gradient - v);
    const F32 scale = simd::Sqrt(second) * s.root_correction + kAdamEpsilon;
    const F32 updated = p - s.rate * first / scale;
    simd::Store(s.m + i, first);
    simd::Store(s.v + i, second);
    simd::Store(s.p + i, updated);
    poison = poison + (updated * 0.0f + raw * 0.0f);
  }
  return simd::HorizontalSum(poison);
}

}  // namespace
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace color3d {
namespace {
HWY_EXPORT(UpdateRow);
}  // namespace

bool AdamStep(const ParameterBlock& gradient,
              const std::vector<float>& learning_rates,
              int64_t step,
              ThreadPool& pool,
              ParameterBlock& parameters,
              AdamMoments& moments,
              float beta1) {
  const double bias1 = 1.0 - std::pow(static_cast<double>(beta1), static_cast<double>(step));
  const double bias2 = 1.0 - std::pow(static_cast<double>(kAdamBeta2), static_cast<double>(step));
  const float root_correction = static_cast<float>(1.0 / std::sqrt(bias2));
  const auto update_row = &COLOR3D_KERNEL(UpdateRow);
  std::atomic<bool> finite{true};
  pool.ForRanges(parameters.blocks(), [&](int64_t begin, int64_t end, int) {
    const ScopedFlushToZero flush;
    for (int row = 0; row < parameters.rows(); ++row) {
      if (learning_rates[row] == 0.0f) continue;
      const RowStep s{gradient.Row(row),
                      parameters.Row(row),
                      moments.first.Row(row),
                      moments.second.Row(row),
                      beta1,
                      static_cast<float>(learning_rates[row] / bias1),
                      root_correction};
      if (!(update_row(s, begin, end) == 0.0f)) finite = false;
    }
  });
  return finite;
}

}  // namespace color3d
#endif  // HWY_ONCE
