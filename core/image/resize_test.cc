#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

TEST(Resize, HalvingAveragesFourPixels) {
  Image image(4, 2, 2);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<float>(i * i);
  const Image half = Resize(image, 2, 1);
  for (int c = 0; c < 2; ++c) {
    for (int x = 0; x < 2; ++x) {
      const float mean = 0.25f * (image.At(c, 0, 2 * x) + image.At(c, 0, 2 * x + 1) +
                                  image.At(c, 1, 2 * x) + image.At(c, 1, 2 * x + 1));
      EXPECT_NEAR(half.At(c, 0, x), mean, 1e-4);
    }
  }
}

TEST(Resize, FractionalShrinkingWeightsByArea) {
  // 3 -> 2 px: the middle pixel is shared.
  Image image(3, 1, 1);
  image.data = {3.0f, 6.0f, 9.0f};
  const Image out = Resize(image, 2, 1);
  EXPECT_NEAR(out.data[0], 3.0f * 2 / 3 + 6.0f / 3, 1e-5);
  EXPECT_NEAR(out.data[1], 6.0f / 3 + 9.0f * 2 / 3, 1e-5);
}

TEST(Resize, EnlargingIsLinearAndPixelCentred) {
  Image image(2, 1, 1);
  image.data = {0.0f, 1.0f};
  const Image out = Resize(image, 4, 1);
  const float expected[] = {0.0f, 0.25f, 0.75f, 1.0f};
  for (int x = 0; x < 4; ++x) EXPECT_NEAR(out.data[x], expected[x], 1e-6);
}

TEST(Resize, MixedScalingKeepsMean) {
  Image image(8, 2, 1);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = static_cast<float>(i % 5);
  const Image out = Resize(image, 2, 4);
  EXPECT_EQ(out.width, 2);
  EXPECT_EQ(out.height, 4);
  double before = 0, after = 0;
  for (float v : image.data) before += v / image.data.size();
  for (float v : out.data) after += v / out.data.size();
  EXPECT_NEAR(before, after, 1e-5);
}

// Readers of confidences require 0..1.
TEST(Resize, StaysWithinValueRange) {
  Random random(7);
  for (int trial = 0; trial < 400; ++trial) {
    Image image(1 + static_cast<int>(random.NextUniform(0, 90)),
                1 + static_cast<int>(random.NextUniform(0, 70)),
                2);
    const bool white = trial % 2 == 0;  // one value, where the weights alone decide
    const auto value = static_cast<float>(trial % 4 == 0 ? 1.0 : random.NextUniform(0.0, 1.0));
    for (float& v : image.data) {
      v = white ? value : static_cast<float>(random.NextUniform(-1.0, 1.0));
    }
    for (int c = 0; c < 2; ++c) image.Plane(c)[0] = value;
    const Image out = Resize(image,
                             1 + static_cast<int>(random.NextUniform(0, 120)),
                             1 + static_cast<int>(random.NextUniform(0, 100)));
    for (int c = 0; c < 2; ++c) {
      const auto range = std::minmax_element(image.Plane(c), image.Plane(c) + image.PlaneSize());
      for (size_t i = 0; i < out.PlaneSize(); ++i) {
        ASSERT_GE(out.Plane(c)[i], *range.first) << trial;
        ASSERT_LE(out.Plane(c)[i], *range.second) << trial;
      }
    }
  }
}

TEST(FitWithin, KeepsAspectAndNeverEnlarges) {
  const Image image(300, 200, 1, 0.5f);
  const Image small = FitWithin(image, 150);
  EXPECT_EQ(small.width, 150);
  EXPECT_EQ(small.height, 100);
  EXPECT_EQ(FitWithin(image, 1000).width, 300);
  EXPECT_EQ(FitWithin(image, 0).width, 300);
  const Image sliver = FitWithin(Image(1000, 1, 1), 10);
  EXPECT_EQ(sliver.height, 1);
  EXPECT_THROW(Resize(image, 0, 5), Error);
  EXPECT_THROW(Resize(Image(), 5, 5), Error);
}

}  // namespace
}  // namespace color3d
