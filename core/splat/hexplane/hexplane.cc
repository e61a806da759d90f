// Deformation by feature planes (hexplane.h), in chunks of 64 Gaussians.
#include "core/splat/hexplane/hexplane.h"

#include <algorithm>

#include "core/simd/instruction_set.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "core/splat/hexplane/hexplane.cc"
#include <hwy/foreach_target.h>

#include "core/simd/simd-inl.h"
#include "core/splat/hexplane/affine-inl.h"
#include "core/splat/hexplane/plane_features-inl.h"

#ifndef COLOR3D_SPLAT_HEXPLANE_ONCE
#define COLOR3D_SPLAT_HEXPLANE_ONCE
namespace color3d {
namespace {

constexpr int64_t kChunk = 64;  // Gaussians; equals affine::kRows
constexpr int kLayers = 3;
constexpr int kOffsetRow[kOffsets] = {kPositionRow,
                                      kPositionRow + 1,
                                      kPositionRow + 2,
                                      kLogScaleRow,
                                      kLogScaleRow + 1,
                                      kLogScaleRow + 2,
                                      kRotationRow,
                                      kRotationRow + 1,
                                      kRotationRow + 2,
                                      kRotationRow + 3};

// Units of an offset in those of its parameter.
float UnitOf(const HexPlaneShape& shape, int offset) { return offset < 3 ? shape.extent : 1.0f; }

// Activations of one chunk; layer k's input is values[k].
struct Activations {
  AlignedFloats coordinates;  // x, y, z, t in -1..1
  AlignedFloats inside;       // 1 where the coordinate is not clamped, else 0
  AlignedFloats values[kLayers + 1];

  explicit Activations(const HexPlaneShape& shape) : coordinates(4 * kChunk), inside(4 * kChunk) {
    for (int layer = 0; layer < kLayers; ++layer) {
      values[layer].assign(static_cast<size_t>(kChunk * shape.LayerInputs(layer)), 0.0f);
    }
    values[kLayers].assign(kChunk * kOffsetStride, 0.0f);
  }
};

// Weights with inputs and outputs exchanged, layer after layer.
AlignedFloats TransposedWeights(const HexPlaneAt& m) {
  AlignedFloats transposed(m.shape.NetworkFloats());
  for (int layer = 0; layer < kLayers; ++layer) {
    const int in = m.shape.LayerInputs(layer), out = m.shape.LayerOutputs(layer);
    const float* from = m.network + m.shape.WeightsBegin(layer);
    float* to = transposed.data() + m.shape.WeightsBegin(layer);
    for (int k = 0; k < in; ++k) {
      for (int o = 0; o < out; ++o) to[o * in + k] = from[k * out + o];
    }
  }
  return transposed;
}

void SetCoordinates(const HexPlaneAt& m,
                    const ParameterBlock& canonical,
                    int64_t begin,
                    int64_t count,
                    Activations& a) {
  for (int axis = 0; axis < 3; ++axis) {
    const float low = m.shape.low[axis], scale = 2.0f / (m.shape.high[axis] - low);
    const float* position = canonical.Row(kPositionRow + axis) + begin;
    for (int64_t i = 0; i < count; ++i) {
      const float u = scale * (position[i] - low) - 1.0f;
      const bool inside = u > -1.0f && u < 1.0f;  // false for NaN
      a.inside[4 * i + axis] = inside ? 1.0f : 0.0f;
      a.coordinates[4 * i + axis] = inside ? u : (u >= 1.0f ? 1.0f : -1.0f);
    }
  }
  for (int64_t i = 0; i < count; ++i) a.coordinates[4 * i + kTimeAxis] = m.t;
}

}  // namespace
}  // namespace color3d
#endif  // COLOR3D_SPLAT_HEXPLANE_ONCE

HWY_BEFORE_NAMESPACE();
namespace color3d {
namespace HWY_NAMESPACE {
namespace {

// Sets all activations of Gaussians [begin, begin + count), count <= kChunk.
void ForwardChunk(const HexPlaneAt& m,
                  const ParameterBlock& canonical,
                  int64_t begin,
                  int64_t count,
                  Activations& a) {
  static_assert(kChunk == affine::kRows);
  SetCoordinates(m, canonical, begin, count, a);
  const int inputs = m.shape.Inputs();
  for (int64_t i = 0; i < count; ++i) {
    planes::Features(m, a.coordinates.data() + 4 * i, a.values[0].data() + i * inputs);
  }
  std::fill(a.values[0].begin() + count * inputs, a.values[0].end(), 0.0f);
  for (int layer = 0; layer < kLayers; ++layer) {
    const int out = m.shape.LayerOutputs(layer);
    affine::Multiply(a.values[layer].data(),
                     m.shape.LayerInputs(layer),
                     m.network + m.shape.WeightsBegin(layer),
                     m.network + m.shape.BiasBegin(layer),
                     out,
                     a.values[layer + 1].data());
    if (layer + 1 < kLayers) affine::Rectify(a.values[layer + 1].data(), out);
  }
}

void ApplyChunks(const HexPlaneAt& m, int64_t begin, int64_t end, ParameterBlock& at) {
  Activations a(m.shape);
  for (int64_t first = begin * kChunk; first < std::min(end * kChunk, at.count());
       first += kChunk) {
    const int64_t count = std::min(kChunk, at.count() - first);
    ForwardChunk(m, at, first, count, a);
    for (int k = 0; k < kOffsets; ++k) {
      float* row = at.Row(kOffsetRow[k]) + first;
      const float unit = UnitOf(m.shape, k);
      for (int64_t i = 0; i < count; ++i) {
        row[i] += unit * a.values[kLayers][static_cast<size_t>(i * kOffsetStride + k)];
      }
    }
  }
}

// Adds to d_planes and d_network, and dL/d(canonical position) through the features to `gradient`.
void BackwardChunks(const HexPlaneAt& m,
                    const float* transposed,
                    const ParameterBlock& canonical,
                    int64_t begin,
                    int64_t end,
                    ParameterBlock& gradient,
                    float* d_planes,
                    float* d_network) {
  Activations a(m.shape), d(m.shape);
  for (int64_t first = begin * kChunk; first < std::min(end * kChunk, canonical.count());
       first += kChunk) {
    const int64_t count = std::min(kChunk, canonical.count() - first);
    ForwardChunk(m, canonical, first, count, a);
    std::fill(d.values[kLayers].begin(), d.values[kLayers].end(), 0.0f);
    for (int k = 0; k < kOffsets; ++k) {
      const float* row = gradient.Row(kOffsetRow[k]) + first;
      const float unit = UnitOf(m.shape, k);
      for (int64_t i = 0; i < count; ++i) {
        d.values[kLayers][static_cast<size_t>(i * kOffsetStride + k)] = unit * row[i];
      }
    }
    for (int layer = kLayers - 1; layer >= 0; --layer) {
      const int in = m.shape.LayerInputs(layer), out = m.shape.LayerOutputs(layer);
      const float* d_out = d.values[layer + 1].data();
      affine::AddWeightGradient(a.values[layer].data(),
                                in,
                                d_out,
                                out,
                                d_network + m.shape.WeightsBegin(layer),
                                d_network + m.shape.BiasBegin(layer));
      affine::Multiply(d_out,
                       out,
                       transposed + m.shape.WeightsBegin(layer),
                       nullptr,
                       in,
                       d.values[layer].data());
      if (layer > 0) affine::RectifyBackward(a.values[layer].data(), in, d.values[layer].data());
    }
    for (int64_t i = 0; i < count; ++i) {
      float d_u[3] = {0.0f, 0.0f, 0.0f};
      planes::FeaturesBackward(m,
                               a.coordinates.data() + 4 * i,
                               d.values[0].data() + i * m.shape.Inputs(),
                               d_planes,
                               d_u);
      for (int axis = 0; axis < 3; ++axis) {
        const float scale = 2.0f / (m.shape.high[axis] - m.shape.low[axis]);
        gradient.Row(kPositionRow + axis)[first + i] += scale * a.inside[4 * i + axis] * d_u[axis];
      }
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
HWY_EXPORT(ApplyChunks);
HWY_EXPORT(BackwardChunks);

constexpr int64_t kSlices = 8;

int64_t Chunks(const ParameterBlock& block) { return (block.count() + kChunk - 1) / kChunk; }

// Sets `sum` to the sum of equally long parts, in their order.
void Sum(const std::vector<AlignedFloats>& parts, ThreadPool& pool, float* sum) {
  pool.ForRanges(static_cast<int64_t>(parts[0].size()), [&](int64_t begin, int64_t end, int) {
    std::copy(parts[0].begin() + begin, parts[0].begin() + end, sum + begin);
    for (size_t k = 1; k < parts.size(); ++k) {
      for (int64_t i = begin; i < end; ++i) sum[i] += parts[k][static_cast<size_t>(i)];
    }
  });
}

// Each head reads its own part of the layer below alone.
void KeepHeadsApart(const HexPlaneShape& shape, float* d_network) {
  float* weights = d_network + shape.WeightsBegin(kLayers - 1);
  const auto clear = [](int head, int column) {
    return column < kFirstOffsetOfHead[head] || column >= kFirstOffsetOfHead[head + 1];
  };
  for (int row = 0; row < kOffsetHeads * shape.width; ++row) {
    for (int column = 0; column < kOffsetStride; ++column) {
      if (clear(row / shape.width, column)) weights[row * kOffsetStride + column] = 0.0f;
    }
  }
}

}  // namespace

void ApplyHexPlanes(const HexPlaneAt& deformation, ThreadPool& pool, ParameterBlock& at) {
  const auto apply = &COLOR3D_KERNEL(ApplyChunks);
  pool.ForRanges(Chunks(at),
                 [&](int64_t begin, int64_t end, int) { apply(deformation, begin, end, at); });
}

void ApplyHexPlanesBackward(const HexPlaneAt& deformation,
                            const ParameterBlock& canonical,
                            ThreadPool& pool,
                            HexPlaneWorkspace& workspace,
                            ParameterBlock& gradient,
                            float* d_planes,
                            float* d_network) {
  const auto backward = &COLOR3D_KERNEL(BackwardChunks);
  const AlignedFloats transposed = TransposedWeights(deformation);
  workspace.planes.resize(kSlices);
  workspace.network.resize(kSlices);
  const int64_t chunks = Chunks(canonical);
  pool.ForEach(kSlices, [&](int64_t slice, int) {
    AlignedFloats& planes = workspace.planes[static_cast<size_t>(slice)];
    AlignedFloats& network = workspace.network[static_cast<size_t>(slice)];
    planes.assign(deformation.shape.PlaneFloats(), 0.0f);
    network.assign(deformation.shape.NetworkFloats(), 0.0f);
    backward(deformation,
             transposed.data(),
             canonical,
             chunks * slice / kSlices,
             chunks * (slice + 1) / kSlices,
             gradient,
             planes.data(),
             network.data());
  });
  Sum(workspace.planes, pool, d_planes);
  Sum(workspace.network, pool, d_network);
  KeepHeadsApart(deformation.shape, d_network);
}

}  // namespace color3d
#endif  // HWY_ONCE
