// The median of a list. Pure.
#pragma once

#include <algorithm>
#include <vector>

namespace color3d {

// Requires at least one value. Returns the mean of the middle two for an even count.
inline double Median(std::vector<double> values) {
  const size_t middle = values.size() / 2;
  std::nth_element(values.begin(), values.begin() + middle, values.end());
  if (values.size() % 2 == 1) return values[middle];
  const double upper = values[middle];
  return 0.5 * (upper + *std::max_element(values.begin(), values.begin() + middle));
}

}  // namespace color3d
