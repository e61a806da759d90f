// Features of one Gaussian from the planes, and the adjoint; sixteen features at a time. Compiled
// once per instruction set: include it only from the kernels' sources below
// <hwy/foreach_target.h>.
#if defined(COLOR3D_PLANE_FEATURES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef COLOR3D_PLANE_FEATURES_INL
#undef COLOR3D_PLANE_FEATURES_INL
#else
#define COLOR3D_PLANE_FEATURES_INL
#endif

#include <algorithm>

#include "core/simd/simd-inl.h"
#include "core/splat/hexplane/hexplane.h"

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace planes {

using simd::F32;
using simd::kLanes;

// A position between the samples of one axis.
struct Cell {
  int first;
  float share;  // of the next sample
};

// `u` is in -1..1.
HWY_INLINE Cell CellAt(float u, int samples) {
  const float x = 0.5f * (u + 1.0f) * static_cast<float>(samples - 1);
  const int first = std::min(static_cast<int>(x), samples - 2);
  return {first, x - static_cast<float>(first)};
}

// The four samples around a point of a plane.
struct Corners {
  size_t at[4];  // floats from the first of all planes: (a, b), (a + 1, b), (a, b + 1), both + 1
  float weight[4];
  float share_a, share_b;
};

// Corners in all planes of one level for coordinates x, y, z, t in -1..1.
HWY_INLINE void CornersAt(
    const HexPlaneShape& shape, int level, size_t begin, const float* u, Corners* corners) {
  Cell cells[4];
  for (int axis = 0; axis < 4; ++axis) cells[axis] = CellAt(u[axis], shape.Samples(level, axis));
  for (int p = 0; p < kHexPlanes; ++p) {
    const Cell a = cells[kHexPlaneAxes[p][0]], b = cells[kHexPlaneAxes[p][1]];
    const int samples = shape.Samples(level, kHexPlaneAxes[p][0]);
    const auto right = static_cast<size_t>(shape.features);
    const size_t down = right * static_cast<size_t>(samples);
    Corners& c = corners[p];
    c.at[0] = begin + down * static_cast<size_t>(b.first) + right * static_cast<size_t>(a.first);
    c.at[1] = c.at[0] + right;
    c.at[2] = c.at[0] + down;
    c.at[3] = c.at[2] + right;
    c.share_a = a.share;
    c.share_b = b.share;
    c.weight[0] = (1.0f - a.share) * (1.0f - b.share);
    c.weight[1] = a.share * (1.0f - b.share);
    c.weight[2] = (1.0f - a.share) * b.share;
    c.weight[3] = a.share * b.share;
    begin += shape.PlaneFloats(level, p);
  }
}

HWY_INLINE F32 Interpolated(const float* all, const Corners& c, int f) {
  F32 sum = c.weight[0] * simd::Load(all + c.at[0] + f);
  for (int k = 1; k < 4; ++k) sum = sum + c.weight[k] * simd::Load(all + c.at[k] + f);
  return sum;
}

// Sets the features of all levels: the products over the planes.
HWY_INLINE void Features(const HexPlaneAt& m, const float* u, float* features) {
  size_t begin = 0;
  for (int level = 0; level < static_cast<int>(m.shape.levels.size()); ++level) {
    Corners corners[kHexPlanes];
    CornersAt(m.shape, level, begin, u, corners);
    for (int f = 0; f < m.shape.features; f += kLanes) {
      F32 product = Interpolated(m.planes, corners[0], f);
      for (int p = 1; p < kHexPlanes; ++p) {
        product = product * Interpolated(m.planes, corners[p], f);
      }
      simd::Store(features + level * m.shape.features + f, product);
    }
    for (int p = 0; p < kHexPlanes; ++p) begin += m.shape.PlaneFloats(level, p);
  }
}

// Adds dL/d(planes), and to `d_u` dL/d(x, y, z).
HWY_INLINE void FeaturesBackward(
    const HexPlaneAt& m, const float* u, const float* d_features, float* d_planes, float* d_u) {
  size_t begin = 0;
  F32 d_axis[4] = {simd::Zero(), simd::Zero(), simd::Zero(), simd::Zero()};
  for (int level = 0; level < static_cast<int>(m.shape.levels.size()); ++level) {
    Corners corners[kHexPlanes];
    CornersAt(m.shape, level, begin, u, corners);
    for (int f = 0; f < m.shape.features; f += kLanes) {
      // Products of the planes before and behind each one.
      F32 value[kHexPlanes], behind[kHexPlanes];
      for (int p = 0; p < kHexPlanes; ++p) value[p] = Interpolated(m.planes, corners[p], f);
      behind[kHexPlanes - 1] = simd::Broadcast(1.0f);
      for (int p = kHexPlanes - 1; p > 0; --p) behind[p - 1] = behind[p] * value[p];
      F32 before = simd::Load(d_features + level * m.shape.features + f);
      for (int p = 0; p < kHexPlanes; ++p) {
        const F32 d = before * behind[p];
        before = before * value[p];
        const Corners& c = corners[p];
        F32 sample[4];
        for (int k = 0; k < 4; ++k) {
          sample[k] = simd::Load(m.planes + c.at[k] + f);
          float* out = d_planes + c.at[k] + f;
          simd::Store(out, simd::Load(out) + c.weight[k] * d);
        }
        const int a = kHexPlaneAxes[p][0], b = kHexPlaneAxes[p][1];
        const F32 along_a =
            (1.0f - c.share_b) * (sample[1] - sample[0]) + c.share_b * (sample[3] - sample[2]);
        const F32 along_b =
            (1.0f - c.share_a) * (sample[2] - sample[0]) + c.share_a * (sample[3] - sample[1]);
        const float half_a = 0.5f * static_cast<float>(m.shape.Samples(level, a) - 1);
        const float half_b = 0.5f * static_cast<float>(m.shape.Samples(level, b) - 1);
        d_axis[a] = d_axis[a] + half_a * (d * along_a);
        d_axis[b] = d_axis[b] + half_b * (d * along_b);
      }
    }
    for (int p = 0; p < kHexPlanes; ++p) begin += m.shape.PlaneFloats(level, p);
  }
  for (int axis = 0; axis < kTimeAxis; ++axis) d_u[axis] += simd::HorizontalSum(d_axis[axis]);
}

}  // namespace planes
}  // namespace HWY_NAMESPACE
}  // namespace color3d
HWY_AFTER_NAMESPACE();

#endif  // COLOR3D_PLANE_FEATURES_INL
