// Colours of cells from the cells of other pictures that look most like them. Torch in the
// interface. Pure functions, thread-safe; they use as many threads as torch is set to, with the
// same result for any number.
#pragma once

#include <torch/types.h>

#include "core/base/cancellation.h"

namespace color3d {

// Cells whose colours are known; features in the space of one Whitening.
struct CellBank {
  torch::Tensor features;  // [n, D]
  torch::Tensor colors;    // [n,2], Lab units
  torch::Tensor weights;   // [n], 0..1: how far each colour is to be trusted
};

struct VoteOptions {
  // A match votes with weight * exp(-(distance - best) / width); width = temperature * (distance of
  // the best match + floor): sharp where the bank shows the same thing, an average where it shows
  // nothing alike.
  double temperature = 0.1;
  double distance_floor = 0.1;
  int max_voters = 0;  // the nearest so many vote; 0: all that have any weight
  // The answer: 0: the voters' weighted mean; else their geometric median, by so many steps of
  // Weiszfeld's algorithm from there, which keeps to one of two hues instead of their grey middle.
  int median_steps = 0;
};

struct CellMatches {
  torch::Tensor ab;        // [q,2], Lab units: the vote; grey where no cell has weight
  torch::Tensor distance;  // [q], squared, to the nearest cell of the bank
  torch::Tensor variance;  // [q], of the voters' ab, Lab units squared: how far they disagree
  torch::Tensor nearest;   // [q], int64: row of the nearest cell in the bank
  // [n]: squared distance from each cell of the bank to the nearest query; undefined unless asked
  // for.
  torch::Tensor bank_distance;
};

// `queries` [q, D] in the bank's space.
CellMatches MatchCells(const torch::Tensor& queries,
                       const CellBank& bank,
                       const VoteOptions& options,
                       const CancellationToken& cancel = {},
                       bool with_bank_distance = false);

// Of all pairs of rows, [x, y].
torch::Tensor SquaredDistances(const torch::Tensor& x, const torch::Tensor& y);

}  // namespace color3d
