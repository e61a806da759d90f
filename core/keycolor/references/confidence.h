// How certain matches between pictures are. Torch in the interface; used inside
// core/keycolor/references only. Pure functions, thread-safe.
#pragma once

#include <torch/types.h>

#include "core/matching/cell_matches.h"

namespace color3d {

inline constexpr double kDistanceFloor = 0.02;  // squared; features are noisy

// [q], 0..1: closeness (the match's squared distance against `distance_scale`) x mutuality (whether
// another cell is nearer to the matched one) x agreement of the voters' colours.
torch::Tensor Confidence(const CellMatches& matches, double distance_scale);

// Squared distance at which a match is no better than chance, half-way (geometrically) between how
// near cells of the references are to their nearest others and how far two of them are apart.
double DistanceScale(const torch::Tensor& sample, const torch::Tensor& features);

}  // namespace color3d
