#include "core/colorizer/training/view_change.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include <algorithm>
#include <cmath>

#include "core/encoder/torch_threads.h"

namespace color3d {
namespace {

// Channels 0 and 1: the position of each pixel's centre, -1..1.
torch::Tensor PositionPicture(int64_t height, int64_t width) {
  torch::Tensor picture = torch::empty({1, 2, height, width});
  auto at = picture.accessor<float, 4>();
  for (int64_t y = 0; y < height; ++y) {
    for (int64_t x = 0; x < width; ++x) {
      at[0][0][y][x] = (2.0f * x + 1.0f) / width - 1.0f;
      at[0][1][y][x] = (2.0f * y + 1.0f) / height - 1.0f;
    }
  }
  return picture;
}

double MaxDifference(const torch::Tensor& x, const torch::Tensor& y) {
  return (x - y).abs().max().item<double>();
}

class ViewChangeTest : public testing::Test {
 protected:
  ViewChangeTest() { SetTorchThreads(1); }
};

TEST_F(ViewChangeTest, IsIdentityByDefault) {
  const torch::Tensor picture = torch::rand({1, 1, 12, 20}) * 100.0;
  const ViewChange none;
  const torch::Tensor grid = SamplingGrid(none.Positions(12, 20), 12, 20);
  EXPECT_LT(MaxDifference(Warp(picture, grid, Border::kZero), picture), 1e-3);
  EXPECT_LT(MaxDifference(none.InLight(picture), picture), 1e-4);
}

TEST_F(ViewChangeTest, QuarterTurnKeepsDistancesInPixels) {
  ViewChange turn;
  turn.angle = std::acos(-1.0) / 2.0;
  const AffineMap map = turn.Positions(100, 200);
  // 50 px to the right of the centre are 50 px below it.
  EXPECT_NEAR(map[0] * 0.5, 0.0, 1e-12);
  EXPECT_NEAR(map[3] * 0.5, 1.0, 1e-12);
}

TEST_F(ViewChangeTest, InverseLeadsBack) {
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    const AffineMap map = ViewChange::Draw(random).Positions(60, 90);
    const AffineMap back = Inverse(map);
    const double x = 0.3, y = -0.7;
    const double u = map[0] * x + map[1] * y + map[2], v = map[3] * x + map[4] * y + map[5];
    EXPECT_NEAR(back[0] * u + back[1] * v + back[2], x, 1e-12);
    EXPECT_NEAR(back[3] * u + back[4] * v + back[5], y, 1e-12);
  }
}

TEST_F(ViewChangeTest, WarpShowsPositionsOfMap) {
  ViewChange change;
  change.angle = 0.2;
  change.scale = 0.6;  // stays within the picture
  change.mirrored = true;
  change.shift_x = 0.05;
  const int64_t height = 30, width = 40;
  const AffineMap map = change.Positions(height, width);
  const torch::Tensor changed =
      Warp(PositionPicture(height, width), SamplingGrid(map, height, width), Border::kZero);
  const torch::Tensor at = PositionPicture(height, width);
  const torch::Tensor x = map[0] * at[0][0] + map[1] * at[0][1] + map[2];
  const torch::Tensor y = map[3] * at[0][0] + map[4] * at[0][1] + map[5];
  EXPECT_LT(MaxDifference(changed[0][0], x), 1e-4);
  EXPECT_LT(MaxDifference(changed[0][1], y), 1e-4);
}

TEST_F(ViewChangeTest, ScaleBelowOneEnlarges) {
  ViewChange change;
  change.scale = 0.5;
  torch::Tensor picture = torch::zeros({1, 1, 16, 16});
  picture.slice(2, 6, 10).slice(3, 6, 10) = 1.0;
  const torch::Tensor changed =
      Warp(picture, SamplingGrid(change.Positions(16, 16), 16, 16), Border::kZero);
  EXPECT_NEAR(changed.sum().item<double>(), 4.0 * picture.sum().item<double>(), 1.0);
}

TEST_F(ViewChangeTest, LightStaysWithinRange) {
  ViewChange change;
  change.light = 5.0;
  change.contrast = 1.1;
  const torch::Tensor l = torch::full({1, 1, 1, 1}, 60.0f);
  EXPECT_NEAR(change.InLight(l).item<double>(), 66.0, 1e-4);
  EXPECT_EQ(change.InLight(torch::full({1, 1, 1, 1}, 99.0f)).item<double>(), 100.0);
}

TEST_F(ViewChangeTest, DrawsEveryKindOfChangeWithinBounds) {
  Random random(1);
  int mirrored = 0;
  double largest_angle = 0.0, largest_light = 0.0;
  for (int i = 0; i < 400; ++i) {
    const ViewChange change = ViewChange::Draw(random);
    mirrored += change.mirrored ? 1 : 0;
    largest_angle = std::max(largest_angle, std::abs(change.angle));
    largest_light = std::max(largest_light, std::abs(change.light));
    EXPECT_GE(change.scale, 1.0 / 1.25);
    EXPECT_LE(change.scale, 1.25);
  }
  EXPECT_NEAR(mirrored, 200, 50);
  EXPECT_GT(largest_angle, 0.24);
  EXPECT_LT(largest_angle, 0.27);
  EXPECT_GT(largest_light, 4.5);
}

}  // namespace
}  // namespace color3d
