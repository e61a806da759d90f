// Removes observations of sparse points in masked parts of photos. Thread-safe.
#pragma once

#include <vector>

#include "core/scene/scene.h"
#include "core/scene/view_images.h"

namespace color3d {

// Returns the points without the observations in masked parts. A point with at least two
// observations is dropped if fewer than two are left; one that never had two is kept.
std::vector<SparsePoint> UnmaskedPoints(const Scene& scene, const ViewImages& images);

}  // namespace color3d
