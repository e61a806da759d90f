// Matching of local features between two pictures. Pure function, thread-safe.
#pragma once

#include <utility>
#include <vector>

#include "core/image/local_features.h"

namespace color3d {

// Index pairs of features of a and b that are mutual nearest neighbours and pass Lowe's ratio test
// (0.8).
std::vector<std::pair<int, int>> MutualMatches(const LocalFeatures& a, const LocalFeatures& b);

}  // namespace color3d
