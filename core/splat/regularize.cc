#include "core/splat/regularize.h"

#include "core/splat/projection_math.h"

namespace color3d {

using namespace splat_internal;  // NOLINT: the kernels' own vocabulary
using simd::I32;

namespace {

using U32 = uint32_t __attribute__((vector_size(64)));

// Sixteen approximately standard normal numbers: the sum of the four bytes of a hash.
F32 HashNormal(uint32_t seed, int64_t first) {
  U32 x = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  x = (x + static_cast<uint32_t>(first)) * 0x9E3779B1u + seed;
  x ^= x >> 16;
  x *= 0x85EBCA6Bu;
  x ^= x >> 13;
  x *= 0xC2B2AE35u;
  x ^= x >> 16;
  const U32 sum = (x & 255u) + (x >> 8 & 255u) + (x >> 16 & 255u) + (x >> 24);
  const F32 centred = __builtin_convertvector((I32)sum, F32) - 510.0f;
  return centred * (1.0f / 147.80f);  // sqrt(4 (256^2 - 1) / 12)
}

}  // namespace

void AddPenaltyGradients(const ParameterBlock& parameters,
                         float opacity_penalty,
                         float scale_penalty,
                         ThreadPool& pool,
                         ParameterBlock& gradient) {
  const float count = static_cast<float>(parameters.count());
  const float opacity_each = opacity_penalty / count, scale_each = scale_penalty / (3.0f * count);
  pool.ForRanges((parameters.count() + 15) / 16, [&](int64_t begin, int64_t end, int) {
    for (int64_t i = begin * 16; i < end * 16; i += 16) {
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
  });
}

void AddPositionNoise(float strength, uint32_t seed, ThreadPool& pool, ParameterBlock& parameters) {
  pool.ForRanges((parameters.count() + 15) / 16, [&](int64_t begin, int64_t end, int) {
    for (int64_t i = begin * 16; i < end * 16; i += 16) {
      Projected g;
      LoadOpacity(parameters, i, g);
      const F32 opacity = 1.0f - g.one_minus_opacity;
      // Solid Gaussians do not move: sigmoid(100 (0.005 - 0.1)) < 1e-4.
      const Mask faint = simd::Less(opacity, Broadcast(0.1f));
      if (!simd::Any(faint)) continue;
      LoadShape(parameters, i, g);
      const F32 gate = 1.0f / (1.0f + simd::Exp2((opacity - 0.005f) * (100.0f * kLog2E)));
      F32 local[3] = {};
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
  });
}

}  // namespace color3d
