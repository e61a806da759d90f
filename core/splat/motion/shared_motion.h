// Locally rigid motion: neighbours share their motion (DYNAMIC.md "Motion").
// Internal to the splat module. Deterministic for every thread count.
#pragma once

#include "core/base/parallel.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {

struct SharedMotionOptions {
  int row = 0;            // first row of motion in the block
  double interval = 1.0;  // from one time step to the next, in units of GaussianMotion's t
  int neighbors = 24;     // of the Gaussian's time step and the two adjacent ones
  double share = 0.05;    // 0: each keeps its own motion, 1: it has that of its neighbours
};

// Moves the velocity of each Gaussian by this share towards u + w x (p - c), the rigid motion that
// best fits its nearest neighbours at its time step. Neighbours are weighted by their opacity (half
// of it if they are of another step) and by their agreement. Acceleration moves towards the
// neighbours' mean likewise. Gaussians with fewer than four neighbours keep their motion.
void ShareMotion(const SharedMotionOptions& options, ThreadPool& pool, ParameterBlock& moving);

}  // namespace color3d
