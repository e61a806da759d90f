// How much the features of one place differ from view to view: what tells views apart but not
// places, and should not count when places are compared. Torch in the interface. Not thread-safe.
#pragma once

#include <torch/types.h>

#include <cstdint>
#include <vector>

#include "core/base/random.h"

namespace color3d {

// The cells of one view.
struct PlacedCells {
  const std::vector<torch::Tensor>& blocks;  // as CellFeatures'
  const torch::Tensor& positions;            // [cells,4], as CellQueries'
};

class ViewNoise {
 public:
  // Adds the pairs of cells that show the same place: of some cells of `x`, drawn at random, the
  // nearest in space of `y`, when it is near. Both views have the same blocks.
  void Add(const PlacedCells& x, const PlacedCells& y, Random& random);

  int64_t pairs() const { return pairs_; }
  // [C,C] of each block, float64: covariance of one view's features about the place's. Empty when
  // too few pairs were found to tell.
  std::vector<torch::Tensor> Covariances() const;

 private:
  std::vector<torch::Tensor> moments_;  // sums over pairs, per block
  int64_t pairs_ = 0;
};

}  // namespace color3d
