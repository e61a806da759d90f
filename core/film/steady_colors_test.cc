#include "core/film/steady_colors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

constexpr int kWidth = 40, kHeight = 30, kFrames = 9;

Image Field(float x, float y) {
  Image flow(kWidth, kHeight, 2);
  std::fill_n(flow.Plane(0), flow.PlaneSize(), x);
  std::fill_n(flow.Plane(1), flow.PlaneSize(), y);
  return flow;
}

// Everything moves by `step` px to the right from frame to frame.
std::shared_ptr<const FlowPair> Motion(float step) {
  return std::make_shared<const FlowPair>(FlowPair{Field(step, 0), Field(-step, 0)});
}

Image Ramp(float moved) {
  Image ab(kWidth, kHeight, 2);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      ab.At(0, y, x) = static_cast<float>(x) - moved;
      ab.At(1, y, x) = static_cast<float>(y);
    }
  }
  return ab;
}

class SteadyColorsTest : public ::testing::Test {
 protected:
  void Add(Image ab, std::shared_ptr<const FlowPair> flow) {
    pictures_.push_back(std::move(ab));
    flows_.push_back(std::move(flow));
  }
  Image Steady(int index, const SteadyColorsOptions& options = {}) const {
    std::vector<MovingFrame> frames;
    for (size_t i = 0; i < pictures_.size(); ++i) frames.push_back({&pictures_[i], flows_[i]});
    return SteadyColors(frames, index, options);
  }
  std::vector<Image> pictures_;
  std::vector<std::shared_ptr<const FlowPair>> flows_;
};

TEST_F(SteadyColorsTest, KeepsColorsThatMoveAlong) {
  for (int i = 0; i < kFrames; ++i) Add(Ramp(2.0f * i), i > 0 ? Motion(2.0f) : nullptr);
  const Image steady = Steady(4);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      ASSERT_NEAR(steady.At(0, y, x), x - 8.0, 1e-4) << x;
      ASSERT_NEAR(steady.At(1, y, x), y, 1e-4) << y;
    }
  }
}

TEST_F(SteadyColorsTest, AveragesFlicker) {
  Random random(3);
  for (int i = 0; i < kFrames; ++i) {
    Image noise = Ramp(0.0f);
    for (float& value : noise.data)
      value += static_cast<float>(10.0 * (random.NextUniform() - 0.5));
    Add(std::move(noise), i > 0 ? Motion(0.0f) : nullptr);
  }
  const Image truth = Ramp(0.0f), steady = Steady(4, {.reach = 4, .persistence = 1.0});
  double before = 0.0, after = 0.0;
  for (size_t i = 0; i < truth.data.size(); ++i) {
    before += std::pow(pictures_[4].data[i] - truth.data[i], 2);
    after += std::pow(steady.data[i] - truth.data[i], 2);
  }
  EXPECT_NEAR(after / before, 1.0 / kFrames, 0.02);
}

TEST_F(SteadyColorsTest, IgnoresUntrackedPixels) {
  Add(Ramp(100.0f), nullptr);
  // Forward and backward flow disagree.
  Add(Ramp(0.0f), std::make_shared<const FlowPair>(FlowPair{Field(3, 0), Field(3, 0)}));
  // A cut.
  Add(Ramp(-100.0f), nullptr);
  EXPECT_EQ(Steady(1).data, pictures_[1].data);
}

TEST_F(SteadyColorsTest, ChangesNothingWithoutReach) {
  Add(Ramp(0.0f), nullptr);
  Add(Ramp(50.0f), Motion(0.0f));
  EXPECT_EQ(Steady(0, {.reach = 0}).data, pictures_[0].data);
  EXPECT_EQ(Steady(0, {.persistence = 0.0}).data, pictures_[0].data);
  EXPECT_THROW(Steady(0, {.reach = -1}), Error);
  EXPECT_THROW(Steady(0, {.persistence = 1.5}), Error);
}

}  // namespace
}  // namespace color3d
