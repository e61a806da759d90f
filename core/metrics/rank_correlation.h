// Spearman's rank correlation. Pure, thread-safe.
#pragma once

#include <vector>

namespace color3d {

// Correlation of two lists of equal length, -1..1; equal values share the mean of their ranks. 0 if
// a list is constant or has fewer than 2 values. Throws Error{kInvalidArgument} for lists of
// different length and for values that are not finite.
double RankCorrelation(const std::vector<float>& x, const std::vector<float>& y);

}  // namespace color3d
