// Variation of features of one place between views, which comparisons of places should ignore.
// Torch in the interface. Not thread-safe.
#pragma once

#include <torch/types.h>

#include <cstdint>
#include <vector>

#include "core/base/random.h"

namespace color3d {

// Cells of one view.
struct PlacedCells {
  const std::vector<torch::Tensor>& blocks;  // as in CellFeatures
  const torch::Tensor& positions;            // [cells,4], as in CellQueries
};

class ViewNoise {
 public:
  // Adds pairs of cells that show the same place: random cells of `x`, each with the nearest cell
  // of `y` in space, if it is near. Requires: both views have the same blocks.
  void Add(const PlacedCells& x, const PlacedCells& y, Random& random);

  int64_t pairs() const { return pairs_; }
  // Returns the covariance of a view's features about the mean of the place, [C,C] for each block,
  // float64, or nothing if there are too few pairs.
  std::vector<torch::Tensor> Covariances() const;

 private:
  std::vector<torch::Tensor> moments_;  // sums over pairs, per block
  int64_t pairs_ = 0;
};

}  // namespace color3d
