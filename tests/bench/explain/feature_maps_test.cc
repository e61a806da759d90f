#include "tests/bench/explain/feature_maps.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"

namespace color3d {
namespace {

// Eight features that are mixtures of three independent patterns; the first has most variance.
Image Mixture(int width, int height, float shift) {
  Image features(width, height, 8);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const float a = 10.0f * std::sin(0.5f * x + shift), b = 3.0f * std::cos(0.4f * y);
      for (int c = 0; c < 8; ++c) {
        features.At(c, y, x) = 7.0f + a * (c % 2 == 0 ? 1.0f : 0.5f) + b * (c < 4 ? 1.0f : -1.0f);
      }
    }
  }
  return features;
}

TEST(PrincipalMapsTest, FirstComponentFollowsLargestPattern) {
  const Image features = Mixture(40, 30, 0.0f);
  const std::vector<Image> maps = PrincipalMaps({&features});
  ASSERT_EQ(maps.size(), 1u);
  double xy = 0.0, xx = 0.0, yy = 0.0, mean = 0.0;
  for (const float value : std::vector<float>(maps[0].Plane(0), maps[0].Plane(1))) mean += value;
  mean /= 1200.0;
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 40; ++x) {
      const double pattern = std::sin(0.5f * x), shown = maps[0].At(0, y, x) - mean;
      xy += pattern * shown, xx += pattern * pattern, yy += shown * shown;
    }
  }
  EXPECT_GT(std::abs(xy) / std::sqrt(xx * yy), 0.97);
}

TEST(PrincipalMapsTest, EqualFeaturesHaveEqualColorsInAllMaps) {
  const Image first = Mixture(40, 30, 0.0f), second = Mixture(24, 30, 0.0f);
  const std::vector<Image> maps = PrincipalMaps({&first, &second});
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(maps[0].At(c, 9, 11), maps[1].At(c, 9, 11), 1e-5);
}

TEST(PrincipalMapsTest, ComponentsWithoutVarianceAreGray) {
  const Image flat(10, 10, 4, 2.5f);
  const std::vector<Image> maps = PrincipalMaps({&flat});
  for (const float value : maps[0].data) EXPECT_EQ(value, 0.5f);
}

TEST(PrincipalMapsTest, RefusesDifferentNumbersOfFeatures) {
  const Image first(10, 10, 4, 1.0f), second(10, 10, 5, 1.0f);
  EXPECT_THROW(PrincipalMaps({&first, &second}), Error);
}

TEST(FeaturesAtTest, InterpolatesBetweenCells) {
  FeatureMap map{Image(4, 4, 1), 8.0};
  for (int x = 0; x < 4; ++x) {
    for (int y = 0; y < 4; ++y) map.values.At(0, y, x) = 8.0f * x + 4.0f;  // x of the centre, px
  }
  EXPECT_NEAR(FeaturesAt(map, 13.5, 20.0)[0], 13.5f, 1e-5);
}

TEST(FeatureDistanceTest, ComparesMatchedPlaces) {
  // The second view is the first, moved by 6 px.
  FeatureMap from{Image(32, 32, 2), 1.0}, to{Image(32, 32, 2), 1.0};
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 32; ++x) {
      from.values.At(0, y, x) = static_cast<float>(x);
      from.values.At(1, y, x) = static_cast<float>(y);
      to.values.At(0, y, x) = static_cast<float>(x - 6);
      to.values.At(1, y, x) = static_cast<float>(y);
    }
  }
  std::vector<PixelMatch> right, wrong;
  for (int y = 4; y < 28; y += 4) {
    for (int x = 4; x < 24; x += 4) {
      right.push_back({x, y, x + 6.5f, y + 0.5f});
      wrong.push_back({x, y, x + 3.5f, y + 0.5f});
    }
  }
  FeatureDistanceMeter good, shifted;
  good.Add(from, to, right);
  shifted.Add(from, to, wrong);
  EXPECT_NEAR(good.Result().matched, 0.0, 1e-5);
  EXPECT_NEAR(shifted.Result().matched, 3.0, 1e-5);
  EXPECT_GT(good.Result().unmatched, 6.0);
  EXPECT_EQ(good.Result().places, 30);
  EXPECT_NEAR(good.Result().Ratio(), 0.0, 1e-6);
}

TEST(FeatureDistanceTest, IgnoresSingleMatch) {
  FeatureDistanceMeter meter;
  const FeatureMap map{Image(8, 8, 1), 1.0};
  meter.Add(map, map, {{1, 1, 1.5f, 1.5f}});
  EXPECT_EQ(meter.Result().places, 0);
}

}  // namespace
}  // namespace color3d
