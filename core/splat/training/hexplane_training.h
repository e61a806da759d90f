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
  ParameterBlock planes;
  ParameterBlock network;
  AdamMoments plane_moments;
  AdamMoments network_moments;
  int64_t steps = 0;  // done
};

// Times of a scene, seconds.
struct HexPlaneTimes {
  double begin_s = 0.0;
  double end_s = 0.0;
  int steps = 1;
};

// The shape for canonical Gaussians that begin at these positions: its box holds 99 % of them along
// each axis, and a tenth more.
HexPlaneShape HexPlaneShapeFor(const ParameterBlock& canonical,
                               const HexPlaneTimes& times,
                               double extent,
                               const HexPlaneTuning& tuning);

class HexPlaneTraining {
 public:
  // For reliefs, offsets that the one pose does not determine stay 0.
  HexPlaneTraining(const HexPlaneShape& shape, const HexPlaneTuning& tuning, bool is_relief)
      : shape_(shape), tuning_(tuning), is_relief_(is_relief) {}

  // No deformation at any time: the last layer is zero.
  HexPlaneState First(uint64_t seed) const;

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

  HexPlaneField Field(const HexPlaneState& state) const;

 private:
  HexPlaneAt Deformation(const HexPlaneState& state, double time_s) const {
    return {shape_, state.planes.Row(0), state.network.Row(0), shape_.UnitTime(time_s)};
  }
  void ClearUnobserved(float* d_network) const;

  const HexPlaneShape shape_;
  const HexPlaneTuning tuning_;
  const bool is_relief_;
  ParameterBlock at_;
  HexPlaneWorkspace workspace_;
  ParameterBlock d_planes_;
  ParameterBlock d_network_;
};

}  // namespace color3d
