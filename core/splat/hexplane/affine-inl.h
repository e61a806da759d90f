// Products of small matrices for the deformation network. Rows are Gaussians, columns are a
// multiple of sixteen. Compiled once per instruction set: include it only from the kernels' sources
// below <hwy/foreach_target.h>.
#if defined(COLOR3D_AFFINE_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef COLOR3D_AFFINE_INL
#undef COLOR3D_AFFINE_INL
#else
#define COLOR3D_AFFINE_INL
#endif

#include "core/simd/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace affine {

using simd::Broadcast;
using simd::F32;
using simd::kLanes;

inline constexpr int kRows = 64;  // of a chunk; arrays have this many, unused ones are zero
inline constexpr int kTogether = 4;

// y = x w + b. x: kRows by `in`, w: `in` by `out`; b may be null.
HWY_INLINE void Multiply(
    const float* x, int in, const float* w, const float* b, int out, float* y) {
  for (int r = 0; r < kRows; r += kTogether) {
    for (int o = 0; o < out; o += kLanes) {
      F32 sum[kTogether];
      for (F32& s : sum) s = b != nullptr ? simd::Load(b + o) : simd::Zero();
      for (int k = 0; k < in; ++k) {
        const F32 weight = simd::Load(w + static_cast<size_t>(k) * out + o);
        for (int j = 0; j < kTogether; ++j) {
          sum[j] = sum[j] + Broadcast(x[static_cast<size_t>(r + j) * in + k]) * weight;
        }
      }
      for (int j = 0; j < kTogether; ++j) {
        simd::Store(y + static_cast<size_t>(r + j) * out + o, sum[j]);
      }
    }
  }
}

// d_w += x' d_y,  d_b += sum of the rows of d_y. `in` is a multiple of kTogether.
HWY_INLINE void AddWeightGradient(
    const float* x, int in, const float* d_y, int out, float* d_w, float* d_b) {
  for (int o = 0; o < out; o += kLanes) {
    F32 bias = simd::Load(d_b + o);
    for (int r = 0; r < kRows; ++r)
      bias = bias + simd::Load(d_y + static_cast<size_t>(r) * out + o);
    simd::Store(d_b + o, bias);
    for (int k = 0; k < in; k += kTogether) {
      F32 sum[kTogether];
      for (int j = 0; j < kTogether; ++j) {
        sum[j] = simd::Load(d_w + static_cast<size_t>(k + j) * out + o);
      }
      for (int r = 0; r < kRows; ++r) {
        const F32 d = simd::Load(d_y + static_cast<size_t>(r) * out + o);
        for (int j = 0; j < kTogether; ++j) {
          sum[j] = sum[j] + Broadcast(x[static_cast<size_t>(r) * in + k + j]) * d;
        }
      }
      for (int j = 0; j < kTogether; ++j) {
        simd::Store(d_w + static_cast<size_t>(k + j) * out + o, sum[j]);
      }
    }
  }
}

HWY_INLINE void Rectify(float* y, int out) {
  for (int i = 0; i < kRows * out; i += kLanes) {
    simd::Store(y + i, simd::Max(simd::Load(y + i), simd::Zero()));
  }
}

// Clears d_y where the rectified y is zero.
HWY_INLINE void RectifyBackward(const float* y, int out, float* d_y) {
  for (int i = 0; i < kRows * out; i += kLanes) {
    const simd::Mask active = simd::Less(simd::Zero(), simd::Load(y + i));
    simd::Store(d_y + i, simd::SelectOrZero(active, simd::Load(d_y + i)));
  }
}

}  // namespace affine
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#endif  // COLOR3D_AFFINE_INL
