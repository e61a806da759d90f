// Confidence interval of a mean over views (METHOD.md "Metrics"). Pure, thread-safe.
#pragma once

#include <vector>

namespace color3d {

// Mean with its 95 % confidence interval: percentile bootstrap over the values, 2,000 samples,
// seed 1. The interval of one value is that value.
struct MeanWithInterval {
  double mean = 0.0;
  double low = 0.0;
  double high = 0.0;
};
// Requires: there are values.
MeanWithInterval BootstrapMean(const std::vector<double>& values);

}  // namespace color3d
