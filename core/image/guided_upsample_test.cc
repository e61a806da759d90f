#include "core/image/guided_upsample.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/image/codec.h"

namespace color3d {
namespace {

TEST(GuidedUpsampleTest, KeepsConstant) {
  Image luminance(40, 30, 1);
  for (size_t i = 0; i < luminance.data.size(); ++i) luminance.data[i] = static_cast<float>(i % 97);
  const Image out = UpsampleGuided(Image(10, 8, 2, -17.0f), luminance, 2, 20.0f);
  ASSERT_EQ(out.width, 40);
  ASSERT_EQ(out.height, 30);
  ASSERT_EQ(out.channels, 2);
  for (float value : out.data) ASSERT_NEAR(value, -17.0f, 1e-3f);
}

TEST(GuidedUpsampleTest, FollowsLuminanceEdge) {
  // The edge lies in the middle of a coarse cell: plain interpolation is off by half the step
  // there.
  Image luminance(64, 64, 1, 20.0f);
  Image truth(64, 64, 1, -30.0f);
  for (int y = 0; y < 64; ++y) {
    for (int x = 34; x < 64; ++x) {
      luminance.At(0, y, x) = 80.0f;
      truth.At(0, y, x) = 30.0f;
    }
  }
  const Image coarse = Resize(truth, 16, 16);
  const Image guided = UpsampleGuided(coarse, luminance, 2, 1.0f);
  const Image plain = Resize(coarse, 64, 64);
  double guided_error = 0.0, plain_error = 0.0;
  for (size_t i = 0; i < truth.data.size(); ++i) {
    guided_error += std::abs(guided.data[i] - truth.data[i]);
    plain_error += std::abs(plain.data[i] - truth.data[i]);
  }
  EXPECT_LT(guided_error, 0.25 * plain_error);
}

TEST(GuidedUpsampleTest, EqualSizesChangeLittle) {
  Image luminance(20, 20, 1);
  Image ab(20, 20, 2);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 20; ++x) {
      luminance.At(0, y, x) = 50.0f + 10.0f * std::sin(0.4f * x);
      ab.At(0, y, x) = 10.0f * std::cos(0.3f * y);
    }
  }
  const Image out = UpsampleGuided(ab, luminance, 2, 20.0f);
  for (size_t i = 0; i < ab.data.size(); ++i) ASSERT_NEAR(out.data[i], ab.data[i], 1e-3f);
}

TEST(GuidedUpsampleTest, AcceptsOnePixel) {
  const Image out = UpsampleGuided(Image(1, 1, 2, 5.0f), Image(7, 3, 1, 40.0f), 2, 20.0f);
  for (float value : out.data) ASSERT_NEAR(value, 5.0f, 1e-4f);
}

}  // namespace
}  // namespace color3d
