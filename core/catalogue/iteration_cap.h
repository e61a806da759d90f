// Sensible number of iterations of geometry for the photos of a scene. The training and plans share
// it. Pure function.
#pragma once

namespace color3d {

// Returns `wanted`, or fewer for few training views: further iterations over them have no benefit.
// Not for the paper's recipe, which does all.
int IterationCap(int wanted, int training_views);

}  // namespace color3d
