#include "core/colorizer/neighbors/feature_neighbors.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include <vector>

#include "core/encoder/image_tensors.h"
#include "tests/support/networks/small_colorizer.h"

namespace color3d {
namespace {

using FeatureNeighborsTest = SmallColorizerTest;

TEST_F(FeatureNeighborsTest, ReturnsColorsOfKeyView) {
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

TEST_F(FeatureNeighborsTest, AgreesWithDefinitionInFloat64) {
  FeatureNeighborsOptions options;
  options.whitening.tap_shares = {1.0, 1.0, 1.0, 1.0, 1.0};
  options.bank_size = 300;
  const FeatureNeighbors neighbors(encoder_, pictures_, options, Random(1), {});
  const torch::Tensor bank = neighbors.bank().features.to(torch::kFloat64);
  const torch::Tensor colors = neighbors.bank().colors.to(torch::kFloat64);
  const CellMatches matches =
      MatchCells({neighbors.bank().features + 0.05f}, neighbors.bank(), options.vote);
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

// A second picture, coloured in its left half alone.
TEST_F(FeatureNeighborsTest, MeasuresVarianceOfCellsWithoutColor) {
  const FeatureNeighbors alone(encoder_, pictures_, {}, Random(1), {});
  EXPECT_EQ(alone.open_variance().size(0), 0);
  std::vector<TrainingPicture> pictures = {pictures_.front(), pictures_.front()};
  Image& weight = pictures[1].weight;
  weight = Image(pictures[1].luminance.width, pictures[1].luminance.height, 1);
  for (int y = 0; y < weight.height; ++y) {
    for (int x = 0; x < weight.width / 2; ++x) weight.At(0, y, x) = 1.0f;
  }
  const auto variance = [&] {
    const FeatureNeighbors neighbors(encoder_, pictures, {}, Random(1), {});
    EXPECT_EQ(neighbors.open_variance().size(0), 192) << "half of 16 x 24 cells";
    return neighbors.open_variance().mean().item<double>();
  };
  const double clear = variance();
  Random noise(3);
  for (float& value : pictures[0].ab.data) {
    value = static_cast<float>(noise.NextUniform(-60.0, 60.0));
  }
  pictures[1].ab = pictures[0].ab;
  EXPECT_GT(variance(), 2.0 * clear + 1.0);
}

// A picture with similar halves at distant positions, red and blue.
TEST_F(FeatureNeighborsTest, SeparatesSimilarPlacesByPosition) {
  constexpr int kSide = 64;
  TrainingPicture picture{"the key view", Image(kSide, kSide, 1), Image(kSide, kSide, 2)};
  picture.position = Image(kSide, kSide, 4);
  Random noise(3);
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const bool left = x < kSide / 2;
      picture.luminance.At(0, y, x) = static_cast<float>(noise.NextUniform(40.0, 60.0));
      picture.ab.At(left ? 0 : 1, y, x) = 40.0f;
      picture.position.At(0, y, x) = left ? -1.0f : 1.0f;
      picture.position.At(3, y, x) = 1.0f;
    }
  }
  FeatureNeighborsOptions options;
  options.relative_chroma.power = 0.0;
  options.vote.position_weight = 50.0;
  const std::vector<TrainingPicture> pictures{picture};
  const FeatureNeighbors made(encoder_, pictures, options, Random(1), {});
  // Also when read from a file.
  TensorFile file;
  made.PutInto(&file);
  const auto neighbors = FeatureNeighbors::TakeFrom(encoder_, options, "the file", &file);
  EXPECT_TRUE(torch::equal(neighbors->bank().positions, made.bank().positions));

  const torch::Tensor l = TensorFromImage(picture.luminance);
  const auto ask = [&](float x) {
    Image position(kSide, kSide, 4, 0.0f);
    for (size_t i = 0; i < position.PlaneSize(); ++i) {
      position.Plane(0)[i] = x;
      position.Plane(3)[i] = 1.0f;
    }
    return neighbors->Lookup(encoder_.Taps(encoder_.Input(l)), l, {}, position).ab;
  };
  EXPECT_GT((ask(-1.0f)[0] - ask(-1.0f)[1]).mean().item<double>(), 30.0);
  EXPECT_LT((ask(1.0f)[0] - ask(1.0f)[1]).mean().item<double>(), -30.0);
}

}  // namespace
}  // namespace color3d
