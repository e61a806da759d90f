#include "tests/bench/pretrain/color_bins.h"

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace color3d {
namespace {

Image Uniform(float a, float b) {
  Image ab(4, 4, 2, a);
  for (size_t i = 0; i < ab.PlaneSize(); ++i) ab.Plane(1)[i] = b;
  return ab;
}

TEST(ColorBinsTest, CountsShares) {
  ColorHistogram histogram;
  for (int i = 0; i < 3; ++i) histogram.Add(Uniform(1.0f, -2.0f));
  histogram.Add(Uniform(41.0f, 29.0f));
  const auto bins = histogram.Bins(0.0);
  ASSERT_EQ(bins.size(), 2u);
  EXPECT_EQ(bins[0].center_ab, (std::array<float, 2>{0.0f, 0.0f}));
  EXPECT_DOUBLE_EQ(bins[0].share, 0.75);
  EXPECT_EQ(bins[1].center_ab, (std::array<float, 2>{40.0f, 30.0f}));
  EXPECT_DOUBLE_EQ(bins[1].share, 0.25);
}

TEST(ColorBinsTest, OmitsRareBinsAndSharesSumToOne) {
  ColorHistogram histogram;
  for (int i = 0; i < 99; ++i) histogram.Add(Uniform(0.0f, 0.0f));
  histogram.Add(Uniform(60.0f, 0.0f));
  const auto bins = histogram.Bins(0.02);
  ASSERT_EQ(bins.size(), 1u);
  EXPECT_DOUBLE_EQ(bins[0].share, 1.0);
}

TEST(ColorBinsTest, CountsOuterColorsAtTheBorder) {
  ColorHistogram histogram;
  histogram.Add(Uniform(1e6f, -1e6f));
  const auto bins = histogram.Bins(0.0);
  ASSERT_EQ(bins.size(), 1u);
  EXPECT_EQ(bins[0].center_ab, (std::array<float, 2>{120.0f, -120.0f}));
}

TEST(ColorBinsTest, RebalancingLiftsRareBinsAndKeepsMean) {
  const std::vector<ColorHistogram::Bin> bins{{{0, 0}, 0.9}, {{60, 0}, 0.1}};
  const std::vector<float> weights = RebalancingWeights(bins, 0.0, 1.0);
  EXPECT_NEAR(weights[1] / weights[0], 9.0, 1e-5);
  EXPECT_NEAR(0.9 * weights[0] + 0.1 * weights[1], 1.0, 1e-6);
  const std::vector<float> none = RebalancingWeights(bins, 0.5, 0.0);
  EXPECT_FLOAT_EQ(none[0], 1.0f);
  EXPECT_FLOAT_EQ(none[1], 1.0f);
}

TEST(ColorBinsTest, RefusesOtherChannelCounts) {
  ColorHistogram histogram;
  EXPECT_THROW(histogram.Add(Image(4, 4, 3)), Error);
}

}  // namespace
}  // namespace color3d
