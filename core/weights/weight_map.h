// Named weights without torch: contents of weight files, random features, and input of digests.
// Plain values.
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

// Ordered by name, so that iteration and digest are deterministic.
using WeightMap = std::map<std::string, WeightArray>;

}  // namespace color3d
