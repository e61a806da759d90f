// Invariants of every weight map that a reader accepts.
#pragma once

#include <cstdio>
#include <cstdlib>

#include "core/weights/weight_map.h"

namespace color3d {

// Shapes and values agree, and the arrays take at most 8 times the bytes of the input plus a
// megabyte.
inline void CheckAccepted(const WeightMap& weights, size_t input_bytes) {
  size_t values = 0;
  for (const auto& [name, array] : weights) {
    size_t count = 1;
    for (int64_t size : array.shape) count *= static_cast<size_t>(size);
    if (count != array.values.size()) {
      std::fprintf(stderr, "%zu values for a shape of %zu\n", array.values.size(), count);
      std::abort();
    }
    values += count;
  }
  if (values * sizeof(float) > 8 * input_bytes + (1 << 20)) {
    std::fprintf(stderr, "%zu values out of %zu bytes\n", values, input_bytes);
    std::abort();
  }
}

}  // namespace color3d
