#include "core/splat/adam.h"

#include <atomic>
#include <cmath>

#include "core/splat/simd.h"

namespace color3d {

using simd::F32;

namespace {

// Returns a vector of zeros when all is finite (x * 0 is NaN for infinities and NaN).
F32 UpdateRow(const float* g,
              float rate,
              float root_correction,
              int64_t begin,
              int64_t end,
              float* p,
              float* m,
              float* v) {
  F32 poison = {};
  for (int64_t i = begin; i < end; i += simd::kLanes) {
    // Clamped so that its square does not overflow; Adam does not depend on the gradient's size.
    const F32 raw = simd::Load(g + i);
    const F32 gradient = simd::Clamp(raw, simd::Broadcast(-1e18f), simd::Broadcast(1e18f));
    const F32 first = simd::Load(m + i) + (1.0f - kAdamBeta1) * (gradient - simd::Load(m + i));
    const F32 second =
        simd::Load(v + i) + (1.0f - kAdamBeta2) * (gradient * gradient - simd::Load(v + i));
    const F32 scale = simd::Sqrt(second) * root_correction + kAdamEpsilon;
    const F32 updated = simd::Load(p + i) - rate * first / scale;
    simd::Store(m + i, first);
    simd::Store(v + i, second);
    simd::Store(p + i, updated);
    poison = poison + updated * 0.0f + raw * 0.0f;
  }
  return poison;
}

}  // namespace

bool AdamStep(const ParameterBlock& gradient,
              const std::vector<float>& learning_rates,
              int64_t step,
              ThreadPool& pool,
              ParameterBlock& parameters,
              AdamMoments& moments) {
  const double bias1 = 1.0 - std::pow(static_cast<double>(kAdamBeta1), static_cast<double>(step));
  const double bias2 = 1.0 - std::pow(static_cast<double>(kAdamBeta2), static_cast<double>(step));
  const float root_correction = static_cast<float>(1.0 / std::sqrt(bias2));
  std::atomic<bool> finite{true};
  pool.ForRanges((parameters.count() + simd::kLanes - 1) / simd::kLanes,
                 [&](int64_t begin, int64_t end, int) {
                   const simd::ScopedFlushToZero flush;
                   F32 poison = {};
                   for (int row = 0; row < parameters.rows(); ++row) {
                     if (learning_rates[row] == 0.0f) continue;
                     poison = poison + UpdateRow(gradient.Row(row),
                                                 static_cast<float>(learning_rates[row] / bias1),
                                                 root_correction,
                                                 begin * simd::kLanes,
                                                 end * simd::kLanes,
                                                 parameters.Row(row),
                                                 moments.first.Row(row),
                                                 moments.second.Row(row));
                   }
                   if (!(simd::HorizontalSum(poison) == 0.0f)) finite = false;
                 });
  return finite;
}

}  // namespace color3d
