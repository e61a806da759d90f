// Motion that neighbours share: in the small, things move rigidly (DYNAMIC.md "Motion").
// Internal to the splat module. Deterministic whatever the thread count.
#pragma once

#include "core/base/parallel.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {

struct SharedMotionOptions {
  int row = 0;            // where motion begins in the block
  double interval = 1.0;  // from one time step to the next, in units of GaussianMotion's t
  int neighbors = 24;     // of the Gaussian's time step and the two beside it
  double share = 0.05;    // 0: each keeps its own motion, 1: it has that of its neighbours
};

// Takes the velocity of each Gaussian that share of the way to u + w x (p - c): the rigid motion
// that fits its nearest neighbours best, each where it is and as it moves at the Gaussian's time
// step, weighted with their opacity (half of it from another step) and with how well they agree.
// Acceleration goes to the neighbours' mean likewise. Gaussians with fewer than four neighbours
// keep their own.
void ShareMotion(const SharedMotionOptions& options, ThreadPool& pool, ParameterBlock& moving);

}  // namespace color3d
