#include "core/metrics/flow_matches.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"

namespace color3d {
namespace {

// Texture, shifted to the left by `shift_px`.
Image Texture(int width, int height, double shift_px) {
  Image image(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double u = x + shift_px;
      double l = 50.0;
      for (int k = 1; k <= 5; ++k) {
        const double a = 2.1 * k;
        l += 7.0 * std::sin(0.13 * k * (u * std::cos(a) + y * std::sin(a)) + 2.7 * a);
      }
      image.At(0, y, x) = static_cast<float>(l);
    }
  }
  return image;
}

TEST(MatchByFlowTest, FindsShift) {
  const auto matches = MatchByFlow(Texture(120, 80, 0.0), Texture(120, 80, 3.0), 2);
  ASSERT_GT(matches.size(), 1200u);  // of 2,400
  double error = 0.0;
  for (const PixelMatch& match : matches) {
    EXPECT_EQ(match.x % 2, 0);
    EXPECT_EQ(match.y % 2, 0);
    error += std::hypot(match.u - (match.x - 2.5), match.v - (match.y + 0.5));
  }
  EXPECT_LT(error / static_cast<double>(matches.size()), 0.3);
}

TEST(MatchByFlowTest, HasFewMatchesInUnrelatedPictures) {
  Image other = Texture(120, 80, 0.0);
  for (int y = 0; y < other.height; ++y) {
    for (int x = 0; x < other.width; ++x) {
      other.At(0, y, x) = static_cast<float>(50.0 + 40.0 * std::sin(0.02 * x * y));
    }
  }
  const size_t all = MatchByFlow(Texture(120, 80, 0.0), Texture(120, 80, 0.0), 2).size();
  EXPECT_LT(MatchByFlow(Texture(120, 80, 0.0), other, 2).size(), all / 2);
}

TEST(MatchByFlowTest, ScalesToSizeOfOtherPhoto) {
  Image half(60, 40, 1);
  const Image texture = Texture(120, 80, 0.0);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 60; ++x) {
      half.At(0, y, x) =
          0.25f * (texture.At(0, 2 * y, 2 * x) + texture.At(0, 2 * y, 2 * x + 1) +
                   texture.At(0, 2 * y + 1, 2 * x) + texture.At(0, 2 * y + 1, 2 * x + 1));
    }
  }
  const auto matches = MatchByFlow(texture, half, 4);
  ASSERT_GT(matches.size(), 300u);  // of 600
  double error = 0.0;
  for (const PixelMatch& match : matches) {
    error += std::hypot(match.u - 0.5 * (match.x + 0.5), match.v - 0.5 * (match.y + 0.5));
  }
  EXPECT_LT(error / static_cast<double>(matches.size()), 0.3);
}

TEST(MatchByFlowTest, RejectsBadInput) {
  EXPECT_THROW(MatchByFlow(Texture(64, 64, 0.0), Texture(64, 64, 0.0), 0), Error);
  EXPECT_THROW(MatchByFlow(Image(64, 64, 3), Image(64, 64, 3), 1), Error);
  EXPECT_TRUE(MatchByFlow(Image(8, 8, 1), Image(8, 8, 1), 1).empty());
}

}  // namespace
}  // namespace color3d
