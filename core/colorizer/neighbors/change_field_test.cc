#include "core/colorizer/neighbors/change_field.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include <cmath>

namespace color3d {
namespace {

// Places on a line in space, with equal features but for `look`.
FieldPlaces Places(const std::vector<double>& x, double look = 0.0, double seen = 0.0) {
  const auto count = static_cast<int64_t>(x.size());
  FieldPlaces places{torch::full({count, 4}, look),
                     torch::zeros({count, 2}),
                     torch::zeros({count, 4}),
                     torch::full({count}, seen)};
  for (int64_t i = 0; i < count; ++i) {
    places.positions[i][0] = x[i];
    places.positions[i][3] = 1.0;
  }
  return places;
}

FieldPlaces Unknown(int64_t count) {
  return {torch::zeros({count, 4}),
          torch::zeros({count, 2}),
          torch::zeros({count, 4}),
          torch::zeros({count})};
}

ChangeField OneStroke(const FieldPlaces& place, double a, double reach = 1.0) {
  const int64_t count = place.seen.size(0);
  return {place,
          torch::full({count, 2}, a),
          torch::ones({count}),
          torch::zeros({count}, torch::kInt64),
          torch::full({count}, reach)};
}

double ChangeAt(const ChangeField& field, const FieldPlaces& places, int row = 0) {
  return field.At(places).change[row][0].item<double>();
}

TEST(ChangeFieldTest, AgreesWithFormulaForOnePlace) {
  const ChangeField field = OneStroke(Places({0.0}), 20.0);
  // At its own place: variance / (variance + noise).
  EXPECT_NEAR(ChangeAt(field, Places({0.0})), 20.0 * 0.9 / 1.0, 1e-4);
  // At a distance of d: wide halves at 0.2, near falls by exp(-(d / 0.1)^2).
  const double alike = 0.5 / 2.0 + 0.4 * std::exp(-4.0);
  EXPECT_NEAR(ChangeAt(field, Places({0.2})), 20.0 * alike, 1e-4);
  EXPECT_NEAR(field.At(Places({0.2})).share[0].item<double>(), alike * alike / 0.9, 1e-5);
}

TEST(ChangeFieldTest, ReachesSimilarAndNearUnseenPlaces) {
  const ChangeField field = OneStroke(Places({0.0, 0.01, 0.02}), 20.0);
  EXPECT_GT(ChangeAt(field, Places({0.01})), 18.0);
  EXPECT_LT(ChangeAt(field, Places({0.01}, /*look=*/3.0)), 0.1);
  EXPECT_LT(ChangeAt(field, Places({0.01}, 0.0, /*seen=*/1.0)), 3.0);
  EXPECT_LT(ChangeAt(field, Places({3.0})), 2.0);
}

TEST(ChangeFieldTest, KeepsPlacesWithTargetColor) {
  const ChangeField field = OneStroke(Places({0.0}), 20.0);
  FieldPlaces right = Places({0.01, 0.01, 0.01});
  right.colors[0].fill_(20.0);  // target colour
  right.colors[1].fill_(15.0);  // nearly
  right.colors[2].fill_(30.0);  // beyond
  EXPECT_NEAR(ChangeAt(field, right, 0), 0.0, 1e-4);
  EXPECT_NEAR(ChangeAt(field, right, 1), 5.0, 1e-4);
  EXPECT_NEAR(ChangeAt(field, right, 2), 0.0, 1e-4);
}

TEST(ChangeFieldTest, ChangesNothingWithoutCorrections) {
  const ChangeField field({}, torch::zeros({0, 2}), {}, {}, {});
  const ChangeField::Answer answer = field.At(Places({0.0, 1.0}));
  EXPECT_EQ(answer.change.abs().max().item<double>(), 0.0);
  EXPECT_EQ(answer.share.max().item<double>(), 0.0);
}

TEST(ChangeFieldTest, UsesLaterOfContradictingStrokes) {
  torch::Tensor changes = torch::zeros({2, 2});
  changes[0][0] = 30.0;
  changes[1][0] = -10.0;
  const ChangeField field(Places({0.0, 0.0}),
                          changes,
                          torch::ones({2}),
                          torch::tensor({int64_t{0}, int64_t{1}}),
                          torch::ones({2}));
  EXPECT_NEAR(ChangeAt(field, Places({0.0})), -9.0, 1e-4);
}

TEST(ChangeFieldTest, ReachIsAPowerOfTheShare) {
  const FieldPlaces asked = Places({0.0, 0.1, 0.3});
  const ChangeField::Answer plain = OneStroke(Places({0.0}), 20.0).At(asked);
  for (const double reach : {0.25, 0.5, 2.0}) {
    const ChangeField::Answer answer = OneStroke(Places({0.0}), 20.0, reach).At(asked);
    for (int i = 0; i < 3; ++i) {
      const double share = plain.share[i].item<double>();
      EXPECT_NEAR(answer.share[i].item<double>(), std::pow(share, 1.0 / reach), 1e-4);
      EXPECT_NEAR(answer.pull[i].item<double>(), share, 1e-5);
      const double change = plain.change[i][0].item<double>();
      const double wanted = std::min(change * std::pow(share, 1.0 / reach - 1.0), 20.0);
      EXPECT_NEAR(answer.change[i][0].item<double>(), wanted, 1e-3);
    }
  }
}

TEST(ChangeFieldTest, ReachBelongsToItsOwnStroke) {
  const auto with_reach = [](double first) {
    return ChangeField(Places({0.0, 3.0}),
                       torch::full({2, 2}, 20.0),
                       torch::ones({2}),
                       torch::tensor({int64_t{0}, int64_t{1}}),
                       torch::tensor({first, 1.0}));
  };
  const FieldPlaces asked = Places({0.1, 3.1});
  const torch::Tensor wide = with_reach(1.0).At(asked).share;
  const torch::Tensor tight = with_reach(0.25).At(asked).share;
  EXPECT_LT(tight[0].item<double>(), 0.5 * wide[0].item<double>());
  EXPECT_NEAR(tight[1].item<double>(), wide[1].item<double>(), 0.05);
  // The pull is that of the last one.
  const torch::Tensor pull = with_reach(1.0).At(asked).pull;
  EXPECT_LT(pull[0].item<double>(), 0.05);
  EXPECT_NEAR(pull[1].item<double>(), wide[1].item<double>(), 0.05);
}

TEST(ChangeFieldTest, StaysFiniteWithoutPositions) {
  const int64_t count = 300;
  const ChangeField field = OneStroke(Unknown(count), 12.0);
  const ChangeField::Answer answer = field.At(Unknown(3));
  EXPECT_NEAR(answer.change[0][0].item<double>(), 12.0, 0.1);
  EXPECT_LE(answer.share.max().item<double>(), 1.0);
  // A known position is another place.
  EXPECT_LT(ChangeAt(field, Places({0.0})), 3.0);
}

TEST(ChangeFieldTest, ProposesDistinctPlacesByGain) {
  // Five places close together, a single one, and a certain one.
  FieldPlaces places = Places({0.0, 0.01, 0.02, 0.03, 0.04, 2.0, -2.0});
  const torch::Tensor deviation = torch::tensor({1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.01});
  const ChangeField none({}, torch::zeros({0, 2}), {}, {}, {});
  const auto proposals = none.Propose(places, deviation, 7);
  ASSERT_GE(proposals.size(), 2U);
  EXPECT_EQ(proposals[0].row, 2);
  EXPECT_EQ(proposals[1].row, 5);
  EXPECT_GT(proposals[0].gain, proposals[1].gain);
  for (const auto& proposal : proposals) EXPECT_NE(proposal.row, 6);
  // Painted places are not proposed again.
  const ChangeField painted = OneStroke(Places({0.01, 0.02}), 5.0);
  EXPECT_EQ(painted.Propose(places, deviation, 1).at(0).row, 5);
}

}  // namespace
}  // namespace color3d
