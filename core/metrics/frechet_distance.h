// Fréchet distance between two sets of features (Heusel et al. 2017; METHOD.md "Metrics"). Pure,
// thread-safe.
#pragma once

#include <vector>

namespace color3d {

// Distance of two normal distributions with the means and covariances (divisor n - 1) of two sets:
//   |m1 - m2|^2 + tr(C1 + C2 - 2 (C1^1/2 C2 C1^1/2)^1/2), at least 0.
// A row for each sample. With fewer samples than features the covariances are singular and the
// distance is biased upwards. Throws Error{kInvalidArgument} for rows of different length, sets of
// fewer than 2 rows and values that are not finite.
double FrechetDistance(const std::vector<std::vector<float>>& first,
                       const std::vector<std::vector<float>>& second);

}  // namespace color3d
