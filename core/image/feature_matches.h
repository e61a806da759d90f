// Which local features of two pictures are of one place. Pure function, thread-safe.
#pragma once

#include <utility>
#include <vector>

#include "core/image/local_features.h"

namespace color3d {

// Features of a and b, by index, that are each other's nearest and clearly nearer than the second
// (Lowe's ratio 0.8).
std::vector<std::pair<int, int>> MutualMatches(const LocalFeatures& a, const LocalFeatures& b);

}  // namespace color3d
