#include "core/metrics/confidence_interval.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(BootstrapMeanTest, IntervalNarrowsWithViews) {
  EXPECT_DOUBLE_EQ(BootstrapMean({2.5}).low, 2.5);
  EXPECT_DOUBLE_EQ(BootstrapMean({2.5}).high, 2.5);
  const auto width = [](int repeats) {
    std::vector<double> values;
    for (int i = 0; i < repeats; ++i) values.insert(values.end(), {1.0, 2.0, 3.0, 4.0});
    const MeanWithInterval mean = BootstrapMean(values);
    EXPECT_DOUBLE_EQ(mean.mean, 2.5);
    EXPECT_LT(mean.low, 2.5);
    EXPECT_GT(mean.high, 2.5);
    return mean.high - mean.low;
  };
  // Standard error of the mean: 1.118 / sqrt(n), times 2 x 1.96.
  EXPECT_NEAR(width(4), 4.383 / 4.0, 0.15);
  EXPECT_NEAR(width(100), 4.383 / 20.0, 0.03);
}

}  // namespace
}  // namespace color3d
