// Colours of cells from the most similar cells of other pictures. Torch in the interface. Pure
// functions, thread-safe. They use torch's number of threads, with the same result for any number.
#pragma once

#include <torch/types.h>

#include "core/base/cancellation.h"

namespace color3d {

// Cells of known colours, with features in the space of one Whitening.
struct CellBank {
  torch::Tensor features;   // [n, D]
  torch::Tensor colors;     // [n,2], Lab units
  torch::Tensor weights;    // [n], 0..1: confidence of each colour
  torch::Tensor positions;  // as in CellQueries
};

// Cells to colour.
struct CellQueries {
  torch::Tensor features;  // [q,D], in the space of the bank
  // [q,4]: position of each cell, x y z in units of the scene's radius, and 1 if it is known, else
  // 0. Undefined: all unknown.
  torch::Tensor positions;
};

struct VoteOptions {
  // A match votes with weight * exp(-(distance - best) / width), or not if that exponential is
  // below exp(-8); width = temperature * (distance of the best match + floor): sharp if the bank
  // contains the same thing, an average if it contains nothing similar.
  double temperature = 0.1;
  double distance_floor = 0.1;
  int max_voters = 0;  // maximum number of voters, the nearest; 0: all with weight
  // Number of steps of Weiszfeld's algorithm from the voters' weighted mean to their geometric
  // median, which is near one of two hues instead of grey in between. 0: the mean.
  int median_steps = 0;
  // Penalty for distance in space: with s the squared distance of two positions,
  // weight * s / (1 + s / reach) is added to the squared distance of the features. It saturates, so
  // that far from all known places none is preferred. 0: no penalty.
  double position_weight = 0.0;
  double position_reach = 1.0;
};

struct CellMatches {
  torch::Tensor ab;        // [q,2], Lab units: result of the vote; grey where no cell has weight
  torch::Tensor distance;  // [q], squared feature distance of the nearest cell of the bank
  torch::Tensor variance;  // [q], variance of the voters' ab, Lab units squared
  torch::Tensor nearest;   // [q], int64: row of the nearest cell in the bank
  // [n]: squared distance from each cell of the bank to the nearest query; undefined unless
  // requested.
  torch::Tensor bank_distance;
};

CellMatches MatchCells(const CellQueries& queries,
                       const CellBank& bank,
                       const VoteOptions& options,
                       const CancellationToken& cancel = {},
                       bool with_bank_distance = false);

// Squared distances of all pairs of rows, [x, y].
torch::Tensor SquaredDistances(const torch::Tensor& x, const torch::Tensor& y);

}  // namespace color3d
