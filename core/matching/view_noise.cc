#include "core/matching/view_noise.h"

#include <torch/types.h>

#include <tuple>

#include "core/matching/cell_features.h"
#include "core/matching/cell_matches.h"

namespace color3d {
namespace {

constexpr int64_t kCellsOfPair = 1000;
constexpr double kReach = 0.03;      // maximum distance, in radii of the scene; about a cell
constexpr int64_t kMinPairs = 2000;  // several times the channels of a block

torch::Tensor PlacedRows(const torch::Tensor& positions) {
  return (positions.select(1, 3) > 0.5).nonzero().squeeze(1);
}

torch::Tensor CellPositions(const torch::Tensor& positions, const torch::Tensor& rows) {
  return positions.index_select(0, rows).slice(1, 0, 3);
}

}  // namespace

void ViewNoise::Add(const PlacedCells& x, const PlacedCells& y, Random& random) {
  torch::Tensor of_x = PlacedRows(x.positions);
  const torch::Tensor of_y = PlacedRows(y.positions);
  if (of_x.size(0) == 0 || of_y.size(0) == 0) return;
  of_x = of_x.index_select(0, SampleRows(of_x.size(0), kCellsOfPair, random));
  torch::Tensor nearest, match;
  std::tie(nearest, match) =
      SquaredDistances(CellPositions(x.positions, of_x), CellPositions(y.positions, of_y)).min(1);
  const torch::Tensor same = (nearest < kReach * kReach).nonzero().squeeze(1);
  if (same.size(0) == 0) return;
  const torch::Tensor rows_x = of_x.index_select(0, same);
  const torch::Tensor rows_y = of_y.index_select(0, match.index_select(0, same));
  moments_.resize(x.blocks.size());
  for (size_t i = 0; i < x.blocks.size(); ++i) {
    const torch::Tensor difference =
        (x.blocks[i].index_select(0, rows_x) - y.blocks[i].index_select(0, rows_y))
            .to(torch::kFloat64);
    const torch::Tensor moment = torch::mm(difference.t(), difference);
    moments_[i] = moments_[i].defined() ? moments_[i] + moment : moment;
  }
  pairs_ += same.size(0);
}

std::vector<torch::Tensor> ViewNoise::Covariances() const {
  if (pairs_ < kMinPairs) return {};
  std::vector<torch::Tensor> covariances;
  // The variance of a difference is twice that of one view.
  for (const torch::Tensor& moment : moments_) {
    covariances.push_back(moment / (2.0 * static_cast<double>(pairs_)));
  }
  return covariances;
}

}  // namespace color3d
