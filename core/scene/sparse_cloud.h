// A start for reconstruction when a scene comes with poses but without sparse points. For this
// folder only.
#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// The point closest to all optical axes, in front of the cameras. When the axes are nearly parallel
// it is pulled to where they would meet if the scene were three baselines away.
Eigen::Vector3d FocusPoint(const Scene& scene);

// Views, ascending, into whose picture a point falls that is further than `near` (scene units)
// from them; of more than 64 an even choice, so that a long film's points stay small.
std::vector<int> ViewsThatFace(const Scene& scene, const Eigen::Vector3d& world, double near);

// Up to `count` points in the views' frusta that at least two (or a quarter, whichever is more) of
// the views see: on random pixels, uniform in inverse depth around the focus. Deterministic for a
// seed. Each lists ViewsThatFace; the reprojection error is -1 (unknown).
std::vector<SparsePoint> RandomPoints(const Scene& scene, int count, uint64_t seed);

}  // namespace color3d
