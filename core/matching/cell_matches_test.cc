#include "core/matching/cell_matches.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include <cstdint>
#include <tuple>

#include "core/base/error.h"

namespace color3d {
namespace {

CellBank RandomBank() {
  torch::manual_seed(1);
  return {torch::rand({300, 16}), torch::rand({300, 2}) * 80.0, torch::rand({300})};
}

// By the definition, in float64.
TEST(CellMatchesTest, LetsNearestCellsVote) {
  const CellBank bank = RandomBank();
  const torch::Tensor queries = torch::rand({200, 16});
  const torch::Tensor all =
      (queries.unsqueeze(1) - bank.features.unsqueeze(0)).to(torch::kFloat64).square().sum(2);
  for (int max_voters : {0, 8}) {
    const VoteOptions options{.temperature = 0.3, .distance_floor = 0.02, .max_voters = max_voters};
    const CellMatches matches = MatchCells({queries}, bank, options, {}, true);
    for (int64_t q = 0; q < queries.size(0); ++q) {
      const int64_t count = max_voters > 0 ? max_voters : 300;
      const auto [d, rows] = all[q].topk(count, 0, /*largest=*/false);
      const double best = d[0].item<double>();
      EXPECT_EQ(matches.nearest[q].item<int64_t>(), rows[0].item<int64_t>());
      EXPECT_NEAR(matches.distance[q].item<double>(), best, 1e-4);
      const torch::Tensor exponent = -(d - best) / (0.3 * (best + 0.02));
      torch::Tensor weight = torch::exp(exponent) * (exponent >= -8.0).to(torch::kFloat64);
      weight = weight * bank.weights.index_select(0, rows);
      const torch::Tensor ab = bank.colors.index_select(0, rows).to(torch::kFloat64);
      const torch::Tensor expected = torch::mv(ab.t(), weight) / weight.sum();
      EXPECT_LT((matches.ab[q] - expected).abs().max().item<double>(), 3e-2);
      const double variance =
          (torch::mv((ab - expected).square().t(), weight) / weight.sum()).sum().item<double>();
      EXPECT_NEAR(matches.variance[q].item<double>(), variance, 1e-2 * (1.0 + variance));
    }
    const auto from_bank = std::get<0>(all.min(0)).to(torch::kFloat32);
    EXPECT_LT((matches.bank_distance - from_bank).abs().max().item<float>(), 1e-4f);
  }
}

// Seven cells of one hue and five of another, all at equal distance from the query.
TEST(CellMatchesTest, MedianChoosesBetweenTwoHues) {
  CellBank bank{torch::zeros({12, 8}), torch::zeros({12, 2}), torch::ones({12})};
  for (int64_t i = 0; i < 12; ++i) bank.colors[i][i < 7 ? 0 : 1] = 60.0;
  const torch::Tensor query = torch::zeros({1, 8});
  const CellMatches mean = MatchCells({query}, bank, {});
  EXPECT_NEAR(mean.ab[0][0].item<float>(), 35.0f, 1e-3f);
  const CellMatches median = MatchCells({query}, bank, {.median_steps = 50});
  EXPECT_GT(median.ab[0][0].item<float>(), 55.0f);
  EXPECT_LT(median.ab[0][1].item<float>(), 5.0f);
  // The variance is that of the voters in both cases.
  EXPECT_EQ(median.variance[0].item<float>(), mean.variance[0].item<float>());
}

TEST(CellMatchesTest, MedianOfEqualColorsIsThatColor) {
  CellBank bank = RandomBank();
  bank.colors.fill_(-31.5f);
  const CellMatches matches = MatchCells({bank.features}, bank, {.median_steps = 5});
  EXPECT_LT((matches.ab + 31.5f).abs().max().item<float>(), 1e-4f);
}

TEST(CellMatchesTest, ReturnsGrayForCellsWithoutWeight) {
  CellBank bank = RandomBank();
  bank.weights.zero_();
  const CellMatches matches = MatchCells({bank.features}, bank, {});
  EXPECT_EQ(matches.ab.abs().max().item<float>(), 0.0f);
  EXPECT_FALSE(matches.bank_distance.defined());
}

// Random positions [n,4], every third unknown.
torch::Tensor RandomPlaces(int64_t count) {
  torch::Tensor places = torch::rand({count, 4}) * 4.0 - 2.0;
  for (int64_t i = 0; i < count; ++i) places[i][3] = i % 3 == 2 ? 0.0 : 1.0;
  return places;
}

// By the definition, in float64.
TEST(CellMatchesTest, PrefersCellsNearInSpace) {
  CellBank bank = RandomBank();
  bank.positions = RandomPlaces(300);
  const CellQueries queries{torch::rand({200, 16}), RandomPlaces(200)};
  const VoteOptions options{
      .temperature = 1e-3, .max_voters = 1, .position_weight = 5.0, .position_reach = 0.5};
  const CellMatches matches = MatchCells(queries, bank, options);
  const auto exact = [](const torch::Tensor& x) { return x.to(torch::kFloat64); };
  int moved = 0;
  for (int64_t q = 0; q < 200; ++q) {
    const torch::Tensor features = exact(bank.features - queries.features[q]).square().sum(1);
    torch::Tensor squares =
        exact(bank.positions - queries.positions[q]).slice(1, 0, 3).square().sum(1);
    squares =
        torch::where(exact(bank.positions).select(1, 3) > 0.5, squares, torch::ones_like(squares));
    if (queries.positions[q][3].item<float>() < 0.5f) squares.zero_();
    const torch::Tensor all = features + 5.0 * squares / (1.0 + squares / 0.5);
    EXPECT_EQ(matches.nearest[q].item<int64_t>(), all.argmin().item<int64_t>());
    EXPECT_NEAR(matches.distance[q].item<double>(), features.min().item<double>(), 1e-4);
    moved += all.argmin().item<int64_t>() != features.argmin().item<int64_t>() ? 1 : 0;
  }
  EXPECT_GT(moved, 50);
}

TEST(CellMatchesTest, IgnoresUnknownPositions) {
  CellBank bank = RandomBank();
  CellQueries queries{torch::rand({50, 16}), RandomPlaces(50)};
  const VoteOptions options{.position_weight = 1.0};
  const torch::Tensor without = MatchCells({queries.features}, bank, options).ab;
  EXPECT_TRUE(torch::equal(MatchCells(queries, bank, options).ab, without));
  bank.positions = torch::zeros({300, 4});
  EXPECT_TRUE(torch::equal(MatchCells(queries, bank, options).ab, without));
  bank.positions = RandomPlaces(300);
  queries.positions.zero_();
  EXPECT_TRUE(torch::equal(MatchCells(queries, bank, options).ab, without));
}

TEST(CellMatchesTest, StopsWhenCancelled) {
  const CellBank bank = RandomBank();
  CancellationToken cancel;
  cancel.Cancel();
  EXPECT_THROW(MatchCells({bank.features}, bank, {}, cancel), Error);
}

TEST(CellMatchesTest, ComputesSquaredDistancesOfAllPairs) {
  const torch::Tensor x = torch::rand({5, 8}), y = torch::rand({9, 8});
  const torch::Tensor expected = (x.unsqueeze(1) - y.unsqueeze(0)).square().sum(2);
  EXPECT_LT((SquaredDistances(x, y) - expected).abs().max().item<float>(), 1e-5f);
}

}  // namespace
}  // namespace color3d
