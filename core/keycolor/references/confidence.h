// Confidence of matches between pictures. Torch in the interface; used inside
// core/keycolor/references only. Pure functions, thread-safe.
#pragma once

#include <torch/types.h>

#include "core/matching/cell_matches.h"

namespace color3d {

inline constexpr double kDistanceFloor = 0.02;  // squared distance, the noise of features

// Returns [q], 0..1: closeness (squared distance of the match relative to `distance_scale`) times
// mutuality (whether another cell is nearer to the matched one) times agreement of the colours of
// the voters.
torch::Tensor Confidence(const CellMatches& matches, double distance_scale);

// Squared distance at which a match is no better than chance: the geometric mean of the typical
// distance of a cell of the references to its nearest other cell and that of two random cells.
double DistanceScale(const torch::Tensor& sample, const torch::Tensor& features);

}  // namespace color3d
