// Sixteen floats at a time with GCC/Clang vector extensions. Internal to the numeric kernels of
// this folder, whose sources are compiled for the machine's instruction set; include it from
// nowhere else. AVX-512 has native masks and reciprocals; other machines take the portable branch.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>

#if defined(__AVX512F__) && defined(__AVX512DQ__)
#define COLOR3D_AVX512 1
#include <immintrin.h>
#elif defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace color3d::simd {

inline constexpr int kLanes = 16;
using F32 = float __attribute__((vector_size(64)));
using I32 = int32_t __attribute__((vector_size(64)));

inline F32 Broadcast(float x) { return F32{x, x, x, x, x, x, x, x, x, x, x, x, x, x, x, x}; }
inline F32 Load(const float* p) {
  F32 v;
  std::memcpy(&v, p, sizeof(v));
  return v;
}
inline void Store(float* p, F32 v) { std::memcpy(p, &v, sizeof(v)); }
inline I32 BitsOf(F32 v) {
  I32 i;
  std::memcpy(&i, &v, sizeof(i));
  return i;
}
inline F32 FromBits(I32 i) {
  F32 v;
  std::memcpy(&v, &i, sizeof(v));
  return v;
}
inline F32 LaneIndex() { return F32{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15}; }

#if COLOR3D_AVX512
using Mask = __mmask16;
inline Mask GreaterEqual(F32 a, F32 b) {
  return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_GE_OQ);
}
inline Mask Less(F32 a, F32 b) { return _mm512_cmp_ps_mask((__m512)a, (__m512)b, _CMP_LT_OQ); }
inline Mask And(Mask a, Mask b) { return static_cast<Mask>(a & b); }
inline Mask Or(Mask a, Mask b) { return static_cast<Mask>(a | b); }
inline Mask Not(Mask a) { return static_cast<Mask>(~a); }
inline F32 Select(Mask m, F32 a, F32 b) {
  return (F32)_mm512_mask_blend_ps(m, (__m512)b, (__m512)a);
}
inline F32 SelectOrZero(Mask m, F32 a) { return (F32)_mm512_maskz_mov_ps(m, (__m512)a); }
inline bool Any(Mask m) { return m != 0; }
inline uint32_t MaskBits(Mask m) { return m; }
inline F32 Sqrt(F32 x) { return (F32)_mm512_sqrt_ps((__m512)x); }
inline F32 Min(F32 a, F32 b) { return (F32)_mm512_min_ps((__m512)a, (__m512)b); }
inline F32 Max(F32 a, F32 b) { return (F32)_mm512_max_ps((__m512)a, (__m512)b); }
// 14-bit estimate and one Newton step: relative error below 2e-7.
inline F32 Reciprocal(F32 x) {
  const F32 r = (F32)_mm512_rcp14_ps((__m512)x);
  return r * (2.0f - x * r);
}
inline float HorizontalSum(F32 v) { return _mm512_reduce_add_ps((__m512)v); }
#else
using Mask = I32;
inline Mask GreaterEqual(F32 a, F32 b) { return a >= b; }
inline Mask Less(F32 a, F32 b) { return a < b; }
inline Mask And(Mask a, Mask b) { return a & b; }
inline Mask Or(Mask a, Mask b) { return a | b; }
inline Mask Not(Mask a) { return ~a; }
inline F32 Select(Mask m, F32 a, F32 b) { return m ? a : b; }
inline F32 SelectOrZero(Mask m, F32 a) { return m ? a : F32{}; }
inline uint32_t MaskBits(Mask m) {
  uint32_t bits = 0;
  for (int i = 0; i < kLanes; ++i) bits |= (m[i] != 0 ? 1u : 0u) << i;
  return bits;
}
inline bool Any(Mask m) { return MaskBits(m) != 0; }
inline F32 Sqrt(F32 x) {
  F32 r;
  for (int i = 0; i < kLanes; ++i) r[i] = std::sqrt(x[i]);
  return r;
}
inline F32 Min(F32 a, F32 b) { return a < b ? a : b; }
inline F32 Max(F32 a, F32 b) { return a > b ? a : b; }
inline F32 Reciprocal(F32 x) { return 1.0f / x; }
inline float HorizontalSum(F32 v) {
  float sum = 0.0f;
  for (int i = 0; i < kLanes; ++i) sum += v[i];
  return sum;
}
#endif

inline F32 Clamp(F32 x, F32 low, F32 high) { return Min(Max(x, low), high); }

// One number, for code that is generic in the number type.
inline float Sqrt(float x) { return std::sqrt(x); }
inline float Min(float a, float b) { return a < b ? a : b; }
inline float Max(float a, float b) { return a > b ? a : b; }
inline float Clamp(float x, float low, float high) { return Min(Max(x, low), high); }

// 2^x for x in [-126, 127], relative error 2e-7: round to the nearest integer by adding 1.5 * 2^23,
// degree-5 Chebyshev interpolant on [-0.5, 0.5], exponent added to the bits.
inline F32 Exp2(F32 x) {
  const F32 shifted = x + 12582912.0f;
  const F32 f = x - (shifted - 12582912.0f);
  F32 p = f * 1.3390863e-3f + 9.6760319e-3f;
  p = p * f + 5.5503571e-2f;
  p = p * f + 2.4022107e-1f;
  p = p * f + 6.9314719e-1f;
  p = p * f + 1.0000001f;
  return FromBits(BitsOf(p) + (BitsOf(shifted) << 23));
}

// log2(x) for normal x > 0: mantissa in [sqrt(1/2), sqrt(2)), atanh series.
inline F32 Log2(F32 x) {
  const I32 exponent = (BitsOf(x) - 0x3f3504f3) >> 23;
  const F32 m = FromBits(BitsOf(x) - (exponent << 23));
  const F32 s = (m - 1.0f) / (m + 1.0f);
  const F32 z = s * s;
  F32 p = z * 0.41219858f + 0.57707802f;  // (2 / ln 2) / 7, / 5, / 3, / 1
  p = p * z + 0.96179669f;
  p = p * z + 2.88539008f;
  return p * s + __builtin_convertvector(exponent, F32);
}

// The sums over the lanes of 8 vectors, to 8 consecutive floats.
inline void HorizontalSums8(const F32* v, float* sums) {
#if COLOR3D_AVX512
  __m256 half[8];
  for (int i = 0; i < 8; ++i) {
    const __m512 x = (__m512)v[i];
    half[i] = _mm256_add_ps(_mm512_castps512_ps256(x), _mm512_extractf32x8_ps(x, 1));
  }
  const __m256 a = _mm256_hadd_ps(half[0], half[1]), b = _mm256_hadd_ps(half[2], half[3]);
  const __m256 c = _mm256_hadd_ps(half[4], half[5]), d = _mm256_hadd_ps(half[6], half[7]);
  const __m256 ab = _mm256_hadd_ps(a, b), cd = _mm256_hadd_ps(c, d);
  _mm_storeu_ps(sums, _mm_add_ps(_mm256_castps256_ps128(ab), _mm256_extractf128_ps(ab, 1)));
  _mm_storeu_ps(sums + 4, _mm_add_ps(_mm256_castps256_ps128(cd), _mm256_extractf128_ps(cd, 1)));
#else
  for (int i = 0; i < 8; ++i) sums[i] = HorizontalSum(v[i]);
#endif
}

// Denormal numbers are flushed to zero on this thread while the object lives: decaying Adam moments
// would otherwise cost a microcode assist each.
class ScopedFlushToZero {
 public:
#if defined(__SSE__)
  ScopedFlushToZero() : saved_(_mm_getcsr()) { _mm_setcsr(saved_ | 0x8040u); }
  ~ScopedFlushToZero() { _mm_setcsr(saved_); }

 private:
  unsigned saved_;
#else
  ScopedFlushToZero() {}
#endif
};

}  // namespace color3d::simd
