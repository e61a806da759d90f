// Colours of cells from the cells of other pictures that look most like them. Torch in the
// interface. Pure functions, thread-safe; they use as many threads as torch is set to, with the
// same result for any number.
#pragma once

#include <torch/types.h>

#include "core/base/cancellation.h"

namespace color3d {

// Cells whose colours are known; features in the space of one Whitening.
struct CellBank {
  torch::Tensor features;   // [n, D]
  torch::Tensor colors;     // [n,2], Lab units
  torch::Tensor weights;    // [n], 0..1: how far each colour is to be trusted
  torch::Tensor positions;  // as CellQueries'
};

// Cells that colours are wanted for.
struct CellQueries {
  torch::Tensor features;  // [q,D] in the bank's space
  // [q,4]: where in space each lies, x y z in units of the scene's radius, and 1 if that is known,
  // else 0. Undefined: not known of any.
  torch::Tensor positions;
};

struct VoteOptions {
  // A match votes with weight * exp(-(distance - best) / width), or not if that exponential is
  // below exp(-8); width = temperature * (distance of the best match + floor): sharp where the bank
  // shows the same thing, an average where it shows nothing alike.
  double temperature = 0.1;
  double distance_floor = 0.1;
  int max_voters = 0;  // the nearest so many vote; 0: all that have any weight
  // The answer: 0: the voters' weighted mean; else their geometric median, by so many steps of
  // Weiszfeld's algorithm from there, which keeps to one of two hues instead of their grey middle.
  int median_steps = 0;
  // Cells that lie apart in space are less alike: with s the squared distance of two positions,
  // weight * s / (1 + s / reach) is added to the squared distance of the features, so that of
  // places that are far from all that is known none is preferred. 0: space does not count.
  double position_weight = 0.0;
  double position_reach = 1.0;
};

struct CellMatches {
  torch::Tensor ab;        // [q,2], Lab units: the vote; grey where no cell has weight
  torch::Tensor distance;  // [q], squared, of the features of the nearest cell of the bank
  torch::Tensor variance;  // [q], of the voters' ab, Lab units squared: how far they disagree
  torch::Tensor nearest;   // [q], int64: row of the nearest cell in the bank
  // [n]: squared distance from each cell of the bank to the nearest query; undefined unless asked
  // for.
  torch::Tensor bank_distance;
};

CellMatches MatchCells(const CellQueries& queries,
                       const CellBank& bank,
                       const VoteOptions& options,
                       const CancellationToken& cancel = {},
                       bool with_bank_distance = false);

// Of all pairs of rows, [x, y].
torch::Tensor SquaredDistances(const torch::Tensor& x, const torch::Tensor& y);

}  // namespace color3d
