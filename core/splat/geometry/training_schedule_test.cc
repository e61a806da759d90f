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
  const std::vector<float> rates = schedule.LearningRates(1.0, {ColorSpace::kSrgb, 3, 2, 2});
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

// Iterations after which the paper's recipe densifies, and resets opacities.
struct PaperEvents {
  std::vector<int> densified, resets;
};
PaperEvents EventsOf(const GeometryOptions& options) {
  const TrainingSchedule schedule(options, 1.0);
  PaperEvents events;
  for (int i = 1; i <= options.iterations; ++i) {
    const double before = schedule.Fraction(i - 1, 0.0), now = schedule.Fraction(i, 0.0);
    if (schedule.DensifyDue(before, now)) events.densified.push_back(i);
    if (schedule.OpacityResetDue(before, now)) events.resets.push_back(i);
  }
  return events;
}

// The reference implementation: after every 100 iterations from 600 on, and every 3000, both below
// half of the iterations.
TEST(TrainingScheduleTest, PaperRecipeIsThatOf3dgs) {
  GeometryOptions options;
  options.recipe = GeometryOptions::Recipe::kPaper;
  options.sh_degree = 3;
  for (const int iterations : {30'000, 7000, 2000, 1000}) {
    options.iterations = iterations;
    std::vector<int> densified, resets;
    for (int i = 600; i < iterations / 2; i += 100) densified.push_back(i);
    for (int i = 3000; i < iterations / 2; i += 3000) resets.push_back(i);
    const PaperEvents events = EventsOf(options);
    EXPECT_EQ(events.densified, densified) << iterations;
    EXPECT_EQ(events.resets, resets) << iterations;
  }
  options.iterations = 30'000;
  EXPECT_EQ(EventsOf(options).densified.size(), 144u);
  EXPECT_THAT(EventsOf(options).resets, testing::ElementsAre(3000, 6000, 9000, 12'000));
  const TrainingSchedule schedule(options, 2.0);
  EXPECT_FALSE(schedule.HasReset(schedule.Fraction(3000, 0.0)));
  EXPECT_TRUE(schedule.HasReset(schedule.Fraction(3100, 0.0)));
  EXPECT_EQ(schedule.ActiveDegree(schedule.Fraction(999, 0.0)), 0);
  EXPECT_EQ(schedule.ActiveDegree(schedule.Fraction(3001, 0.0)), 3);
  // Decays over all iterations, to 1 % at their end.
  EXPECT_NEAR(schedule.PositionRate(0.0), 2.0 * 1.6e-4, 1e-12);
  EXPECT_NEAR(schedule.PositionRate(schedule.Fraction(15'000, 0.0)), 2.0 * 1.6e-5, 1e-12);
  EXPECT_NEAR(schedule.PositionRate(1.0), 2.0 * 1.6e-6, 1e-12);
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
