// Training of a deformation by feature planes beside the canonical Gaussians (DYNAMIC.md
// "HexPlane"). Internal to the splat module. Not thread-safe; uses the pool's threads.
// Deterministic for every thread count.
#pragma once

#include <cstdint>

#include "core/base/parallel.h"
#include "core/splat/hexplane/hexplane.h"
#include "core/splat/hexplane/hexplane_tuning.h"
#include "core/splat/model/hexplane_field.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/training/adam.h"

namespace color3d {

// What is trained, as in HexPlaneField; blocks of one row.
struct HexPlaneState {
  HexPlaneShape shape;
  ParameterBlock planes;
  ParameterBlock network;
  AdamMoments plane_moments;
  AdamMoments network_moments;
  int64_t steps = 0;  // done

  bool empty() const { return network.count() == 0; }
};

// Visits all values in the order of checkpoints. `archive`: CheckpointWriter or CheckpointReader.
template <class Archive, class State>
void VisitHexPlaneState(Archive& archive, State& state) {
  archive.Value(state.shape.begin_s);
  archive.Value(state.shape.end_s);
  archive.Value(state.shape.low);
  archive.Value(state.shape.high);
  archive.Value(state.shape.extent);
  archive.Value(state.shape.features);
  archive.Value(state.shape.width);
  archive.Vector(state.shape.levels);
  archive.Block(state.planes);
  archive.Block(state.network);
  archive.Block(state.plane_moments.first);
  archive.Block(state.plane_moments.second);
  archive.Block(state.network_moments.first);
  archive.Block(state.network_moments.second);
  archive.Value(state.steps);
}

// Times of a scene, seconds.
struct HexPlaneTimes {
  double begin_s = 0.0;
  double end_s = 0.0;
  int steps = 1;
};

// The first state for canonical Gaussians that begin at these positions. Nothing is deformed: the
// last layer is zero. The box holds 99 % of the positions along each axis, and a tenth more.
HexPlaneState FirstHexPlanes(const ParameterBlock& canonical,
                             const HexPlaneTimes& times,
                             double extent,
                             const HexPlaneTuning& tuning,
                             uint64_t seed);

// Peak memory of training a deformation of so many time steps, bytes: parameters, moments, the last
// good state, gradients, their partial sums and a checkpoint.
int64_t HexPlaneBytes(const HexPlaneTuning& tuning, int time_steps);

// Empty for an empty state.
HexPlaneField FieldOf(const HexPlaneState& state);

class HexPlaneTraining {
 public:
  // For reliefs, offsets that the one pose does not determine stay 0.
  HexPlaneTraining(const HexPlaneTuning& tuning, bool is_relief)
      : tuning_(tuning), is_relief_(is_relief) {}

  // Returns true from the given fraction of the schedule on.
  bool IsActive(double fraction) const { return fraction >= tuning_.from; }

  // The canonical Gaussians at a time of the scene, valid until the next call.
  const ParameterBlock& At(const HexPlaneState& state,
                           const ParameterBlock& canonical,
                           double time_s,
                           ThreadPool& pool);

  // One step of Adam at this fraction of the schedule, with rates times `scale`. `gradient` is
  // dL/d(At) on entry and dL/d(canonical) on return. Returns false if a value was not finite.
  bool Update(const ParameterBlock& canonical,
              double time_s,
              double fraction,
              double scale,
              ThreadPool& pool,
              ParameterBlock& gradient,
              HexPlaneState& state);

 private:
  const HexPlaneTuning tuning_;
  const bool is_relief_;
  ParameterBlock at_;
  HexPlaneWorkspace workspace_;
  ParameterBlock d_planes_;
  ParameterBlock d_network_;
};

}  // namespace color3d
