// Sixteen floats at a time: one AVX-512 register, two of AVX2, four of SSE4 or NEON, behind one
// value type, so that the kernels are written once (a block of 4x4 pixels is one F32). Operations
// come from Highway. Compiled once per instruction set: include it only from the kernels' sources
// below <hwy/foreach_target.h>. Products and sums contract to fused ones where the set has them.
#if defined(COLOR3D_SPLAT_SIMD_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef COLOR3D_SPLAT_SIMD_INL
#undef COLOR3D_SPLAT_SIMD_INL
#else
#define COLOR3D_SPLAT_SIMD_INL
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

// The members r.part[k] = EXPRESSION, written out: the registers never become an array in memory.
#undef COLOR3D_PARTS
#define COLOR3D_PART(K, EXPRESSION) \
  {                                 \
    constexpr int k = K;            \
    r.part[k] = EXPRESSION;         \
  }
#if HWY_MAX_BYTES >= 64
#define COLOR3D_PARTS(EXPRESSION) COLOR3D_PART(0, EXPRESSION)
#elif HWY_MAX_BYTES == 32
#define COLOR3D_PARTS(EXPRESSION) COLOR3D_PART(0, EXPRESSION) COLOR3D_PART(1, EXPRESSION)
#else
#define COLOR3D_PARTS(EXPRESSION) \
  COLOR3D_PART(0, EXPRESSION)     \
  COLOR3D_PART(1, EXPRESSION) COLOR3D_PART(2, EXPRESSION) COLOR3D_PART(3, EXPRESSION)
#endif

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace simd {

namespace hn = hwy::HWY_NAMESPACE;

inline constexpr int kLanes = 16;
using FloatTag = hn::CappedTag<float, kLanes>;
using IntTag = hn::RebindToSigned<FloatTag>;
inline constexpr int kRegisterLanes = HWY_MAX_BYTES >= 64 ? kLanes : HWY_MAX_BYTES / 4;
inline constexpr int kParts = kLanes / kRegisterLanes;

struct F32 {
  hn::Vec<FloatTag> part[kParts];
};
struct I32 {
  hn::Vec<IntTag> part[kParts];
};
struct Mask {
  hn::Mask<FloatTag> part[kParts];
};

HWY_INLINE F32 Broadcast(float x) {
  F32 r;
  const auto all = hn::Set(FloatTag(), x);
  COLOR3D_PARTS(all)
  return r;
}
HWY_INLINE I32 Broadcast(int32_t x) {
  I32 r;
  const auto all = hn::Set(IntTag(), x);
  COLOR3D_PARTS(all)
  return r;
}
HWY_INLINE F32 Zero() { return Broadcast(0.0f); }
HWY_INLINE F32 Load(const float* p) {
  F32 r;
  COLOR3D_PARTS(hn::LoadU(FloatTag(), p + k * kRegisterLanes))
  return r;
}
HWY_INLINE I32 Load(const int32_t* p) {
  I32 r;
  COLOR3D_PARTS(hn::LoadU(IntTag(), p + k * kRegisterLanes))
  return r;
}
HWY_INLINE void Store(float* p, F32 v) {
  for (int k = 0; k < kParts; ++k) hn::StoreU(v.part[k], FloatTag(), p + k * kRegisterLanes);
}
HWY_INLINE void Store(int32_t* p, I32 v) {
  for (int k = 0; k < kParts; ++k) hn::StoreU(v.part[k], IntTag(), p + k * kRegisterLanes);
}
// Sixteen 16-bit whole numbers; stored ones must be in 0..65535 and are cut off, not rounded.
using U16Tag = hn::Rebind<uint16_t, FloatTag>;
HWY_INLINE F32 LoadU16(const uint16_t* p) {
  F32 r;
  COLOR3D_PARTS(hn::ConvertTo(FloatTag(),
                              hn::PromoteTo(IntTag(), hn::LoadU(U16Tag(), p + k * kRegisterLanes))))
  return r;
}
HWY_INLINE void StoreU16(uint16_t* p, F32 v) {
  for (int k = 0; k < kParts; ++k) {
    const auto whole = hn::ConvertTo(IntTag(), v.part[k]);
    hn::StoreU(hn::DemoteTo(U16Tag(), whole), U16Tag(), p + k * kRegisterLanes);
  }
}
HWY_INLINE F32 LaneIndex() {
  alignas(64) static constexpr float kIndex[kLanes] = {
      0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
  return Load(kIndex);
}

#define COLOR3D_BINARY(TYPE, NAME, OPERATION)          \
  HWY_INLINE TYPE NAME(TYPE a, TYPE b) {               \
    TYPE r;                                            \
    COLOR3D_PARTS(hn::OPERATION(a.part[k], b.part[k])) \
    return r;                                          \
  }
#define COLOR3D_ARITHMETIC(NAME, OPERATION)                             \
  COLOR3D_BINARY(F32, NAME, OPERATION)                                  \
  HWY_INLINE F32 NAME(F32 a, float b) { return NAME(a, Broadcast(b)); } \
  HWY_INLINE F32 NAME(float a, F32 b) { return NAME(Broadcast(a), b); }
COLOR3D_ARITHMETIC(operator+, Add)
COLOR3D_ARITHMETIC(operator-, Sub)
COLOR3D_ARITHMETIC(operator*, Mul)
COLOR3D_ARITHMETIC(operator/, Div)
COLOR3D_BINARY(F32, Min, Min)
COLOR3D_BINARY(F32, Max, Max)
COLOR3D_BINARY(I32, operator+, Add)
COLOR3D_BINARY(I32, operator-, Sub)
COLOR3D_BINARY(I32, operator|, Or)
COLOR3D_BINARY(I32, Max, Max)
COLOR3D_BINARY(Mask, And, And)
#undef COLOR3D_ARITHMETIC
#undef COLOR3D_BINARY

HWY_INLINE F32 operator-(F32 a) {
  F32 r;
  COLOR3D_PARTS(hn::Neg(a.part[k]))
  return r;
}
HWY_INLINE F32 Sqrt(F32 a) {
  F32 r;
  COLOR3D_PARTS(hn::Sqrt(a.part[k]))
  return r;
}
HWY_INLINE F32 Clamp(F32 x, F32 low, F32 high) { return Min(Max(x, low), high); }
HWY_INLINE F32 Abs(F32 a) {
  F32 r;
  COLOR3D_PARTS(hn::Abs(a.part[k]))
  return r;
}
// An estimate (14, 12 or 8 bits) and Newton steps: relative error below 3e-7.
HWY_INLINE F32 Reciprocal(F32 x) {
  F32 r;
  COLOR3D_PARTS(hn::ApproximateReciprocal(x.part[k]))
#if HWY_ARCH_ARM
  r = r * (2.0f - x * r);
#endif
  return r * (2.0f - x * r);
}

// Comparisons are false for NaN.
HWY_INLINE Mask GreaterEqual(F32 a, F32 b) {
  Mask r;
  COLOR3D_PARTS(hn::Ge(a.part[k], b.part[k]))
  return r;
}
HWY_INLINE Mask Less(F32 a, F32 b) {
  Mask r;
  COLOR3D_PARTS(hn::Lt(a.part[k], b.part[k]))
  return r;
}
HWY_INLINE F32 Select(Mask m, F32 a, F32 b) {
  F32 r;
  COLOR3D_PARTS(hn::IfThenElse(m.part[k], a.part[k], b.part[k]))
  return r;
}
HWY_INLINE F32 SelectOrZero(Mask m, F32 a) {
  F32 r;
  COLOR3D_PARTS(hn::IfThenElseZero(m.part[k], a.part[k]))
  return r;
}
HWY_INLINE I32 SelectOrZero(Mask m, I32 a) {
  I32 r;
  COLOR3D_PARTS(hn::IfThenElseZero(hn::RebindMask(IntTag(), m.part[k]), a.part[k]))
  return r;
}
HWY_INLINE bool Any(Mask m) {
  bool any = false;
  for (int k = 0; k < kParts; ++k) any = any || !hn::AllFalse(FloatTag(), m.part[k]);
  return any;
}
// Bit i: lane i.
HWY_INLINE uint32_t MaskBits(Mask m) {
  uint32_t bits = 0;
  for (int k = 0; k < kParts; ++k) {
    uint8_t bytes[8] = {};
    hn::StoreMaskBits(FloatTag(), m.part[k], bytes);
    bits |= (uint32_t{bytes[0]} | uint32_t{bytes[1]} << 8) << (k * kRegisterLanes);
  }
  return bits;
}

HWY_INLINE I32 BitsOf(F32 v) {
  I32 r;
  COLOR3D_PARTS(hn::BitCast(IntTag(), v.part[k]))
  return r;
}
HWY_INLINE F32 FromBits(I32 v) {
  F32 r;
  COLOR3D_PARTS(hn::BitCast(FloatTag(), v.part[k]))
  return r;
}
// Towards zero.
HWY_INLINE I32 Truncate(F32 v) {
  I32 r;
  COLOR3D_PARTS(hn::ConvertTo(IntTag(), v.part[k]))
  return r;
}
HWY_INLINE F32 ToFloat(I32 v) {
  F32 r;
  COLOR3D_PARTS(hn::ConvertTo(FloatTag(), v.part[k]))
  return r;
}
template <int kBits>
HWY_INLINE I32 ShiftLeft(I32 v) {
  I32 r;
  COLOR3D_PARTS(hn::ShiftLeft<kBits>(v.part[k]))
  return r;
}
// Keeps the sign.
template <int kBits>
HWY_INLINE I32 ShiftRight(I32 v) {
  I32 r;
  COLOR3D_PARTS(hn::ShiftRight<kBits>(v.part[k]))
  return r;
}
HWY_INLINE I32 ShiftLeft(I32 v, I32 bits) {
  I32 r;
  COLOR3D_PARTS(hn::Shl(v.part[k], bits.part[k]))
  return r;
}

// 2^x for x in [-126, 127], relative error 2e-7: round to the nearest integer by adding 1.5 * 2^23,
// degree-5 Chebyshev interpolant on [-0.5, 0.5], exponent added to the bits.
HWY_INLINE F32 Exp2(F32 x) {
  const F32 shifted = x + 12582912.0f;
  const F32 f = x - (shifted - 12582912.0f);
  F32 p = f * 1.3390863e-3f + 9.6760319e-3f;
  p = p * f + 5.5503571e-2f;
  p = p * f + 2.4022107e-1f;
  p = p * f + 6.9314719e-1f;
  p = p * f + 1.0000001f;
  return FromBits(BitsOf(p) + ShiftLeft<23>(BitsOf(shifted)));
}

// log2(x) for normal x > 0: mantissa in [sqrt(1/2), sqrt(2)), atanh series.
HWY_INLINE F32 Log2(F32 x) {
  const I32 exponent = ShiftRight<23>(BitsOf(x) - Broadcast(int32_t{0x3f3504f3}));
  const F32 m = FromBits(BitsOf(x) - ShiftLeft<23>(exponent));
  const F32 s = (m - 1.0f) / (m + 1.0f);
  const F32 z = s * s;
  F32 p = z * 0.41219858f + 0.57707802f;  // (2 / ln 2) / 7, / 5, / 3, / 1
  p = p * z + 0.96179669f;
  p = p * z + 2.88539008f;
  return p * s + ToFloat(exponent);
}

HWY_INLINE float HorizontalSum(F32 v) {
  auto sum = v.part[0];
  for (int k = 1; k < kParts; ++k) sum = hn::Add(sum, v.part[k]);
  return hn::GetLane(hn::SumOfLanes(FloatTag(), sum));
}

// Square root of x >= 0 without the slow instruction: an estimate and a Newton step, relative error
// below 4e-7 for x >= 1e-30, and next to nothing below.
HWY_INLINE F32 FastSqrt(F32 x) {
  x = Max(x, Broadcast(1e-30f));
  F32 r;
  COLOR3D_PARTS(hn::ApproximateReciprocalSqrt(x.part[k]))
#if HWY_ARCH_ARM
  r = r * (1.5f - 0.5f * x * r * r);
#endif
  return x * (r * (1.5f - 0.5f * x * r * r));
}

#if HWY_TARGET == HWY_AVX3
namespace detail {
// [a, b] as halves of the register, each folded from four 128-bit lanes to two.
HWY_INLINE __m512 FoldHalves(__m512 a, __m512 b) {
  return _mm512_add_ps(_mm512_mask_blend_ps(0xFF00, a, b), _mm512_shuffle_f32x4(a, b, 0x4E));
}
// From [a, b] and [c, d] to one lane of four partial sums each: [a, c, b, d].
HWY_INLINE __m512 FoldLanes(__m512 ab, __m512 cd) {
  const __m512 rest = _mm512_mask_blend_ps(0x0F0F, ab, cd);
  return _mm512_add_ps(_mm512_mask_blend_ps(0xF0F0, ab, cd),
                       _mm512_shuffle_f32x4(rest, rest, 0xB1));
}
// Two partial sums of p and two of q in each lane.
HWY_INLINE __m512 FoldPairs(__m512 p, __m512 q) {
  return _mm512_add_ps(_mm512_mask_blend_ps(0xCCCC, p, q), _mm512_shuffle_ps(p, q, 0x4E));
}
}  // namespace detail
#endif

// The sums over the lanes of kCount <= 12 vectors to consecutive floats, padded with zeros to a
// multiple of four, at least 8.
template <int kCount>
HWY_INLINE void HorizontalSums(const F32* v, float* sums) {
  static_assert(kCount > 4 && kCount <= 12);
#if HWY_TARGET == HWY_AVX3
  const auto raw = [v](int i)
                       HWY_ATTR { return i < kCount ? v[i].part[0].raw : _mm512_setzero_ps(); };
  const auto four = [&](int i) HWY_ATTR {
    return detail::FoldLanes(detail::FoldHalves(raw(i), raw(i + 1)),
                             detail::FoldHalves(raw(i + 2), raw(i + 3)));
  };
  const __m512 p = detail::FoldPairs(four(0), four(4));
  __m512 q = _mm512_setzero_ps();
  if constexpr (kCount > 8) q = detail::FoldPairs(four(8), q);
  const __m512 total = _mm512_add_ps(_mm512_shuffle_ps(p, q, 0x88), _mm512_shuffle_ps(p, q, 0xDD));
  const __m512 ordered = _mm512_permutexvar_ps(
      _mm512_setr_epi32(0, 8, 4, 12, 1, 9, 5, 13, 2, 10, 6, 14, 3, 11, 7, 15), total);
  _mm256_storeu_ps(sums, _mm512_castps512_ps256(ordered));
  if constexpr (kCount > 8) _mm_storeu_ps(sums + 8, _mm512_extractf32x4_ps(ordered, 2));
#elif HWY_TARGET == HWY_AVX2
  const auto pair = [v](int i) HWY_ATTR {
    const auto half = [v](int j) HWY_ATTR {
      return j < kCount ? _mm256_add_ps(v[j].part[0].raw, v[j].part[1].raw) : _mm256_setzero_ps();
    };
    return _mm256_hadd_ps(half(i), half(i + 1));
  };
  for (int i = 0; i < kCount || i < 8; i += 4) {
    const __m256 four = _mm256_hadd_ps(pair(i), pair(i + 2));
    _mm_storeu_ps(sums + i,
                  _mm_add_ps(_mm256_castps256_ps128(four), _mm256_extractf128_ps(four, 1)));
  }
#else
  for (int i = 0; i < (kCount > 8 ? 12 : 8); ++i) sums[i] = i < kCount ? HorizontalSum(v[i]) : 0.0f;
#endif
}

}  // namespace simd
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#endif  // COLOR3D_SPLAT_SIMD_INL
