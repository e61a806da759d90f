// Initial points for reconstruction if a scene has poses but no sparse points. For this folder
// only.
#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// Returns the point closest to all optical axes, in front of the cameras. For nearly parallel axes
// it is pulled towards where they would meet three baselines away.
Eigen::Vector3d FocusPoint(const Scene& scene);

// Returns the views, ascending, whose picture contains a point that is farther than `near` (scene
// units) from them; if there are more than 64, an even selection, to bound the size of long films.
std::vector<int> ViewsFacing(const Scene& scene, const Eigen::Vector3d& world, double near);

// Returns up to `count` points that at least two views, or a quarter of them if that is more, see:
// on random pixels, uniform in inverse depth around the focus. Deterministic for a seed. Each lists
// ViewsFacing; the reprojection error is -1 (unknown).
std::vector<SparsePoint> RandomPoints(const Scene& scene, int count, uint64_t seed);

}  // namespace color3d
