#include "core/colorizer/feature_neighbors.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include <vector>

#include "tests/support/networks/small_colorizer.h"

namespace color3d {
namespace {

using FeatureNeighborsTest = SmallColorizerTest;

TEST_F(FeatureNeighborsTest, NeighborsOfTheKeyViewHaveItsColors) {
  FeatureNeighborsOptions options;
  options.whitening.tap_shares = {1.0, 1.0, 1.0, 1.0, 1.0};
  const FeatureNeighbors neighbors(encoder_, pictures_, options, Random(1), {});
  const torch::Tensor l = KeyTensor();
  const NeighborColors found = neighbors.Lookup(encoder_.Taps(encoder_.Input(l)), l);
  ASSERT_EQ(found.ab.sizes(), (std::vector<int64_t>{2, 16, 24}));
  // Away from the border between the two colours.
  EXPECT_NEAR(found.ab[0].slice(1, 2, 9).mean().item<double>(), 40.0, 2.0);
  EXPECT_NEAR(found.ab[0].slice(1, 15, 22).mean().item<double>(), -40.0, 2.0);
  EXPECT_LT(found.distance.mean().item<double>(), 0.1);
}

TEST_F(FeatureNeighborsTest, NeighborsAgreeWithTheDefinitionInFloat64) {
  FeatureNeighborsOptions options;
  options.whitening.tap_shares = {1.0, 1.0, 1.0, 1.0, 1.0};
  options.bank_size = 300;
  const FeatureNeighbors neighbors(encoder_, pictures_, options, Random(1), {});
  const torch::Tensor bank = neighbors.bank().features.to(torch::kFloat64);
  const torch::Tensor colors = neighbors.bank().colors.to(torch::kFloat64);
  const CellMatches matches =
      MatchCells(neighbors.bank().features + 0.05f, neighbors.bank(), options.vote);
  const torch::Tensor answer = matches.ab.to(torch::kFloat64);
  for (int64_t q = 0; q < 5; ++q) {
    const torch::Tensor d = (bank - (bank[q] + 0.05)).square().sum(1);
    const torch::Tensor best = d.min();
    const torch::Tensor weight =
        torch::exp(-(d - best) / (options.vote.temperature * (best + options.vote.distance_floor)));
    const torch::Tensor expected = torch::mv(colors.t(), weight) / weight.sum();
    EXPECT_LT((answer[q] - expected).abs().max().item<double>(), 1e-2);
    const double variance =
        (torch::mv((colors - expected).square().t(), weight) / weight.sum()).sum().item<double>();
    EXPECT_NEAR(matches.variance[q].item<double>(), variance, 1e-2 * (1.0 + variance));
  }
}

}  // namespace
}  // namespace color3d
