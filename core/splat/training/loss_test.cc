#include "core/splat/training/loss.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/random.h"
#include "tests/reference/splat.h"
#include "tests/support/instruction_set_testing.h"

namespace color3d {
namespace {

using Planes = std::vector<std::vector<double>>;

PlaneBuffer RandomPicture(int width, int height, int channels, uint64_t seed) {
  Random random(seed);
  PlaneBuffer p(width, height, channels);
  for (int c = 0; c < channels; ++c) {
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        p.Row(c, y)[x] =
            static_cast<float>(0.5 + 0.3 * std::sin(0.3 * x + seed) * std::cos(0.2 * y) +
                               random.NextUniform(-0.15, 0.15));
      }
    }
  }
  return p;
}

Planes ToPlanes(const PlaneBuffer& p) {
  Planes planes;
  for (int c = 0; c < p.channels; ++c) {
    planes.emplace_back();
    for (int y = 0; y < p.height; ++y) {
      planes.back().insert(planes.back().end(), p.Row(c, y), p.Row(c, y) + p.width);
    }
  }
  return planes;
}

struct Case {
  int width, height, channels;
  LossWeights weights;
  bool weighted;
};

using LossTest = InstructionSetTest<Case>;

TEST_P(LossTest, AgreesWithFloat64AndFiniteDifferences) {
  const Case& c = TestCase();
  ThreadPool pool(2);
  const PlaneBuffer x = RandomPicture(c.width, c.height, c.channels, 1);
  const PlaneBuffer y = RandomPicture(c.width, c.height, c.channels, 2);
  PlaneBuffer w = RandomPicture(c.width, c.height, 1, 3);
  const std::vector<double> w64 = c.weighted ? ToPlanes(w)[0] : std::vector<double>();
  ImageLoss loss;
  PlaneBuffer gradient;
  const LossValue value = loss.Evaluate(x, y, c.weighted ? &w : nullptr, c.weights, pool, gradient);
  Planes x64 = ToPlanes(x);
  const Planes y64 = ToPlanes(y);
  const auto reference = [&] { return ReferenceLoss(x64, y64, w64, c.width, c.height, c.weights); };
  EXPECT_NEAR(value.total, reference(), 2e-6);
  double scale = 0.0;
  for (int ch = 0; ch < c.channels; ++ch) {
    for (int r = 0; r < c.height; ++r) {
      for (int k = 0; k < c.width; ++k) {
        scale = std::max(scale, std::abs(static_cast<double>(gradient.Row(ch, r)[k])));
      }
      for (int k = c.width; k < gradient.stride; ++k) EXPECT_EQ(gradient.Row(ch, r)[k], 0.0f);
    }
  }
  Random random(7);
  for (int trial = 0; trial < 40; ++trial) {
    const int ch = static_cast<int>(random.NextBelow(c.channels));
    const int r = trial < 4 ? (trial / 2) * (c.height - 1) : random.NextBelow(c.height);
    const int k = trial < 4 ? (trial % 2) * (c.width - 1) : random.NextBelow(c.width);
    double& pixel = x64[ch][static_cast<size_t>(r) * c.width + k];
    const double saved = pixel, h = 1e-6;
    pixel = saved + h;
    const double above = reference();
    pixel = saved - h;
    const double below = reference();
    pixel = saved;
    EXPECT_NEAR(gradient.Row(ch, r)[k], (above - below) / (2.0 * h), 1e-3 * scale)
        << "channel " << ch << " row " << r << " column " << k;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Cases,
    LossTest,
    testing::Combine(testing::Values(Case{23, 19, 1, {0.8f, 0.2f, 1.0f}, false},
                                     Case{32, 16, 2, {0.8f, 0.2f, 0.0f}, true},
                                     Case{17, 21, 3, {0.0f, 1.0f, 0.5f}, true},
                                     Case{2, 2, 1, {0.8f, 0.2f, 1.0f}, false},
                                     Case{1, 1, 1, {0.8f, 0.2f, 1.0f}, false}),
                     EachInstructionSet()));

TEST(ImageLossTest, EqualPicturesLeaveCharbonnierFloor) {
  ThreadPool pool(1);
  const PlaneBuffer x = RandomPicture(40, 30, 1, 1);
  ImageLoss loss;
  PlaneBuffer gradient;
  const LossValue value = loss.Evaluate(x, x, nullptr, {}, pool, gradient);
  EXPECT_EQ(value.l1, 0.0);
  EXPECT_NEAR(value.ssim, 0.0, 1e-5);
  EXPECT_NEAR(value.edge, kCharbonnierEpsilon, 1e-6);
}

}  // namespace
}  // namespace color3d
