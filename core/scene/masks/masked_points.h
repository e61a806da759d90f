// Sparse points of what masks leave out. Thread-safe.
#pragma once

#include <vector>

#include "core/scene/scene.h"
#include "core/scene/view_images.h"

namespace color3d {

// The points without the observations that lie where their photo is masked out. A point that keeps
// fewer than two of at least two is left out; one that never had two stays as it is.
std::vector<SparsePoint> UnmaskedPoints(const Scene& scene, const ViewImages& images);

}  // namespace color3d
