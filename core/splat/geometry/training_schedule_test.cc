#include "core/splat/geometry/training_schedule.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/splat/model/gaussian_cap.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {
namespace {

TEST(TrainingScheduleTest, FollowsFartherOfTimeAndIterations) {
  GeometryOptions options;
  options.iterations = 1000;
  const TrainingSchedule untimed(options, 1.0);
  EXPECT_DOUBLE_EQ(untimed.Fraction(250, 1e9), 0.25);
  GeometryOptions timed_options = options;
  timed_options.time_limit_seconds = 20.0;
  const TrainingSchedule timed(timed_options, 1.0);
  EXPECT_DOUBLE_EQ(timed.Fraction(250, 1.0), 0.25);
  EXPECT_DOUBLE_EQ(timed.Fraction(250, 10.0), 0.5);
  EXPECT_DOUBLE_EQ(timed.Fraction(250, 30.0), 1.0);
  EXPECT_DOUBLE_EQ(timed.Fraction(2000, 0.0), 1.0);
}

TEST(TrainingScheduleTest, EndsAtFullSizeWithFinalRates) {
  const GeometryOptions options;
  const TrainingSchedule schedule(options, 2.0);
  Camera camera;
  camera.width = 500;
  camera.height = 375;
  EXPECT_GT(schedule.Level(0.0, camera), 0);
  EXPECT_EQ(schedule.Level(0.999, camera), 0);
  EXPECT_EQ(schedule.ActiveDegree(0.0), 0);
  EXPECT_EQ(schedule.ActiveDegree(0.999), options.sh_degree);
  EXPECT_NEAR(schedule.PositionRate(1.0), 2.0 * schedule.tuning().position_rate_last, 1e-9);
  const std::vector<float> rates = schedule.LearningRates(1.0, 3);
  ASSERT_EQ(rates.size(), static_cast<size_t>(kColorRow + 3 * 9));
  EXPECT_FLOAT_EQ(rates[kColorRow], rates[kColorRow + 9]);
  EXPECT_GT(rates.back(), 0.0f);
  camera.width = camera.height = 90;  // too small to be halved
  EXPECT_EQ(schedule.Level(0.0, camera), 0);
}

TEST(TrainingScheduleTest, DropoutGrowsWithFewerViews) {
  GeometryOptions options;
  const TrainingSchedule schedule(options, 1.0);
  EXPECT_EQ(schedule.DropRate(0.0, 9), 0.0);
  EXPECT_DOUBLE_EQ(schedule.DropRate(0.5, 9), 0.5 * schedule.DropRate(1.0, 9));
  EXPECT_DOUBLE_EQ(schedule.DropRate(1.0, 9), 0.2);
  EXPECT_DOUBLE_EQ(schedule.DropRate(1.0, 24), 0.05);
  EXPECT_DOUBLE_EQ(schedule.DropRate(1.0, 0), 0.2);
  options.recipe = GeometryOptions::Recipe::kPaper;
  EXPECT_EQ(TrainingSchedule(options, 1.0).DropRate(1.0, 9), 0.0);
}

// 2 % of the pixels, of few views counted at up to 500 px.
TEST(GaussianCapTest, FollowsViewCountIfSparse) {
  const std::vector<Camera> nine(9, Camera{4000, 3000, 3000.0, 3000.0, 2000.0, 1500.0});
  EXPECT_EQ(GaussianCap(40'000, nine, 500), 33'750);
  EXPECT_EQ(GaussianCap(120'000, nine, 800), 33'750);
  EXPECT_EQ(GaussianCap(120'000, nine, 0), 33'750);
  EXPECT_EQ(GaussianCap(120'000, nine, 250), 8460);
  const std::vector<Camera> many(24, nine[0]);  // a quarter counts at 500 px
  EXPECT_EQ(GaussianCap(400'000, many, 800), 195'300);
  EXPECT_EQ(GaussianCap(400'000, many, 500), 90'000);
  EXPECT_EQ(GaussianCap(20'000, nine, 500), 20'000);
  EXPECT_EQ(GaussianCap(40'000, {nine[0]}, 100), 5000);
}

TEST(IterationCapTest, GrowsWithViewsAndAllowsDefault) {
  EXPECT_EQ(IterationCap(1500, 3), 1500);
  EXPECT_EQ(IterationCap(5000, 3), 1500);
  EXPECT_EQ(IterationCap(5000, 12), 1800);
  EXPECT_EQ(IterationCap(5000, 50), 5000);
  EXPECT_EQ(IterationCap(100'000, 1'000'000'000), 100'000);
}

TEST(TrainingScheduleTest, PaperRecipeSchedulesByIteration) {
  GeometryOptions options;
  options.recipe = GeometryOptions::Recipe::kPaper;
  options.iterations = 15'000;
  options.sh_degree = 3;
  const TrainingSchedule schedule(options, 1.0);
  std::vector<int> densified, resets;
  for (int i = 1; i <= options.iterations; ++i) {
    const double before = schedule.Fraction(i - 1, 0.0), now = schedule.Fraction(i, 0.0);
    if (schedule.DensifyDue(before, now)) densified.push_back(i);
    if (schedule.OpacityResetDue(before, now)) resets.push_back(i);
  }
  ASSERT_GE(densified.size(), 70u);
  EXPECT_NEAR(densified.front(), 500, 1);
  EXPECT_NEAR(densified[1] - densified[0], 100, 1);
  EXPECT_NEAR(densified.back(), 7500, 1);
  EXPECT_THAT(resets, testing::SizeIs(2));
  EXPECT_NEAR(resets[0], 3000, 1);
  EXPECT_EQ(schedule.ActiveDegree(schedule.Fraction(999, 0.0)), 0);
  EXPECT_EQ(schedule.ActiveDegree(schedule.Fraction(3001, 0.0)), 3);
  Camera camera;
  camera.width = camera.height = 1000;
  EXPECT_EQ(schedule.Level(0.0, camera), 0);
}

TEST(TrainingScheduleTest, ShortTimeLimitReducesGaussianCap) {
  GeometryOptions options;
  options.iterations = 100'000;
  options.max_gaussians = 50'000;
  options.tuning.emplace().wanted_iterations = 1000;
  const TrainingSchedule untimed(options, 1.0);
  EXPECT_EQ(untimed.AffordableCount(0.5, 10, 1.0, 0, 1000), 50'000);
  GeometryOptions timed_options = options;
  timed_options.time_limit_seconds = 10.0;
  const TrainingSchedule timed(timed_options, 1.0);
  // 9 s are left for 900 iterations.
  EXPECT_NEAR(timed.AffordableCount(0.1, 100, 0.005, 0, 1000), 2000, 1);
  EXPECT_LT(timed.AffordableCount(0.1, 100, 0.005, 1, 1000), 2000);
  EXPECT_EQ(timed.AffordableCount(0.1, 100, 0.5, 0, 1000), 1000);
  EXPECT_EQ(timed.AffordableCount(0.1, 100, 1e-9, 0, 1000), 50'000);
}

}  // namespace
}  // namespace color3d
