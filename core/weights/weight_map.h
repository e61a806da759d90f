// Named weights without torch: what a weight file holds, what random features make, and what the
// digest is taken over. Plain values.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace color3d {

struct WeightArray {
  std::vector<int64_t> shape;
  std::vector<float> values;  // row-major
};

// Ordered by name, so that iteration (and the digest) is the same everywhere.
using WeightMap = std::map<std::string, WeightArray>;

}  // namespace color3d
