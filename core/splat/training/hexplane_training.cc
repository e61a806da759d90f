#include "core/splat/training/hexplane_training.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/random.h"
#include "core/splat/training/hexplane_penalties.h"

namespace color3d {
namespace {

constexpr double kOutside = 0.005;   // share of the Gaussians beyond each side of the box
constexpr double kMargin = 0.1;      // of the box's size, added to it
constexpr double kLeastSize = 1e-3;  // of the box, relative to the extent
constexpr int kMaxTimeSamples = 150;
// First features of the planes of space; planes with time begin at 1.
constexpr double kFirstFeature[2] = {0.1, 0.5};
constexpr size_t kCopies = 3 + 3 + 1 + 8 + 3;  // HexPlaneBytes
constexpr uint64_t kStream = 7;                // of random numbers

// Uniform weights of variance 2 / (inputs + outputs) (Glorot & Bengio 2010). One head's part of the
// layer counts as its outputs.
void FillLayer(int inputs, int outputs, size_t count, Random& random, float* weights) {
  const double bound = std::sqrt(6.0 / (inputs + outputs));
  for (size_t i = 0; i < count; ++i) {
    weights[i] = static_cast<float>(random.NextUniform(-bound, bound));
  }
}

// All but times and box.
HexPlaneShape SizesOf(const HexPlaneTuning& tuning, int time_steps) {
  HexPlaneShape shape;
  shape.features = tuning.features;
  shape.width = tuning.width;
  const int time_samples = std::clamp(
      static_cast<int>(std::lround(tuning.samples_of_step * time_steps)), 2, kMaxTimeSamples);
  for (int level = 0; level < tuning.levels; ++level) {
    shape.levels.push_back({tuning.space_samples << level, time_samples});
  }
  return shape;
}

HexPlaneShape ShapeFor(const ParameterBlock& canonical,
                       const HexPlaneTimes& times,
                       double extent,
                       const HexPlaneTuning& tuning) {
  HexPlaneShape shape = SizesOf(tuning, times.steps);
  shape.begin_s = times.begin_s;
  shape.end_s = times.end_s;
  shape.extent = static_cast<float>(extent);
  for (int axis = 0; axis < 3; ++axis) {
    const float* row = canonical.Row(kPositionRow + axis);
    std::vector<float> sorted(row, row + canonical.count());
    std::sort(sorted.begin(), sorted.end());
    const auto outside = static_cast<size_t>(kOutside * static_cast<double>(sorted.size()));
    const double low = sorted[outside], high = sorted[sorted.size() - 1 - outside];
    const double margin = 0.5 * std::max(kMargin * (high - low), kLeastSize * extent);
    shape.low[axis] = static_cast<float>(low - margin);
    shape.high[axis] = static_cast<float>(high + margin);
  }
  return shape;
}

HexPlaneAt Deformation(const HexPlaneState& state, double time_s) {
  return {state.shape, state.planes.Row(0), state.network.Row(0), state.shape.UnitTime(time_s)};
}

// Depth, extent along it and tilt, as TrainingSchedule.
void ClearUnobservedOfRelief(const HexPlaneShape& shape, float* d_network) {
  for (const int offset : {2, 5, 7, 8}) {
    d_network[shape.BiasBegin(2) + static_cast<size_t>(offset)] = 0.0f;
    float* weights = d_network + shape.WeightsBegin(2);
    for (int row = 0; row < shape.LayerInputs(2); ++row) {
      weights[row * kOffsetStride + offset] = 0.0f;
    }
  }
}

}  // namespace

HexPlaneState FirstHexPlanes(const ParameterBlock& canonical,
                             const HexPlaneTimes& times,
                             double extent,
                             const HexPlaneTuning& tuning,
                             uint64_t seed) {
  HexPlaneState state;
  state.shape = ShapeFor(canonical, times, extent, tuning);
  const HexPlaneShape& shape = state.shape;
  Random random(seed, kStream);
  state.planes = ParameterBlock(1, static_cast<int64_t>(shape.PlaneFloats()));
  for (int level = 0; level < static_cast<int>(shape.levels.size()); ++level) {
    for (int plane = 0; plane < kHexPlanes; ++plane) {
      float* feature = state.planes.Row(0) + shape.PlaneBegin(level, plane);
      const bool with_time = kHexPlaneAxes[plane][1] == kTimeAxis;
      for (size_t i = 0; i < shape.PlaneFloats(level, plane); ++i) {
        feature[i] =
            with_time ? 1.0f
                      : static_cast<float>(random.NextUniform(kFirstFeature[0], kFirstFeature[1]));
      }
    }
  }
  state.network = ParameterBlock(1, static_cast<int64_t>(shape.NetworkFloats()));
  for (int layer = 0; layer < 2; ++layer) {
    const int inputs = shape.LayerInputs(layer);
    FillLayer(inputs,
              shape.width,
              static_cast<size_t>(inputs) * static_cast<size_t>(shape.LayerOutputs(layer)),
              random,
              state.network.Row(0) + shape.WeightsBegin(layer));
  }
  state.plane_moments = {state.planes.ZerosOfSameShape(), state.planes.ZerosOfSameShape()};
  state.network_moments = {state.network.ZerosOfSameShape(), state.network.ZerosOfSameShape()};
  return state;
}

const ParameterBlock& HexPlaneTraining::At(const HexPlaneState& state,
                                           const ParameterBlock& canonical,
                                           double time_s,
                                           ThreadPool& pool) {
  at_ = canonical;
  ApplyHexPlanes(Deformation(state, time_s), pool, at_);
  return at_;
}

bool HexPlaneTraining::Update(const ParameterBlock& canonical,
                              double time_s,
                              double fraction,
                              double scale,
                              ThreadPool& pool,
                              ParameterBlock& gradient,
                              HexPlaneState& state) {
  if (!d_planes_.HasShapeOf(state.planes)) d_planes_ = state.planes.ZerosOfSameShape();
  if (!d_network_.HasShapeOf(state.network)) d_network_ = state.network.ZerosOfSameShape();
  ApplyHexPlanesBackward(Deformation(state, time_s),
                         canonical,
                         pool,
                         workspace_,
                         gradient,
                         d_planes_.Row(0),
                         d_network_.Row(0));
  AddPlanePenalties(state.shape, tuning_, state.planes.Row(0), pool, d_planes_.Row(0));
  if (is_relief_) ClearUnobservedOfRelief(state.shape, d_network_.Row(0));
  const double progress =
      std::clamp((fraction - tuning_.from) / std::max(1e-9, 1.0 - tuning_.from), 0.0, 1.0);
  const double now = scale * std::pow(tuning_.last_rate, progress);
  ++state.steps;
  const bool finite = AdamStep(d_planes_,
                               {static_cast<float>(now * tuning_.plane_rate)},
                               state.steps,
                               pool,
                               state.planes,
                               state.plane_moments);
  return AdamStep(d_network_,
                  {static_cast<float>(now * tuning_.network_rate)},
                  state.steps,
                  pool,
                  state.network,
                  state.network_moments) &&
         finite;
}

int64_t HexPlaneBytes(const HexPlaneTuning& tuning, int time_steps) {
  const HexPlaneShape shape = SizesOf(tuning, time_steps);
  return static_cast<int64_t>(sizeof(float) * kCopies *
                              (shape.PlaneFloats() + shape.NetworkFloats()));
}

HexPlaneField FieldOf(const HexPlaneState& state) {
  if (state.empty()) return {};
  const float* planes = state.planes.Row(0);
  const float* network = state.network.Row(0);
  return {state.shape,
          std::vector<float>(planes, planes + state.planes.count()),
          std::vector<float>(network, network + state.network.count())};
}

}  // namespace color3d
