// Penalties on feature planes and their gradient (DYNAMIC.md "HexPlane"). Internal to the splat
// module. Deterministic for every thread count.
#pragma once

#include "core/base/parallel.h"
#include "core/splat/hexplane/hexplane_tuning.h"
#include "core/splat/model/hexplane_field.h"

namespace color3d {

// Adds the gradient to `d_planes` and returns the penalty: of every plane of space the mean of
// squared differences of neighbours times tuning.variation; of every plane with time the mean of
// squared second differences along time times tuning.smoothness, and the mean distance from 1 times
// tuning.time_change. Both arrays have shape.PlaneFloats() floats.
double AddPlanePenalties(const HexPlaneShape& shape,
                         const HexPlaneTuning& tuning,
                         const float* planes,
                         ThreadPool& pool,
                         float* d_planes);

}  // namespace color3d
