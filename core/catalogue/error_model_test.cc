#include "core/catalogue/error_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "core/base/error.h"

namespace color3d {
namespace {

TEST(ErrorModelTest, EstimateFallsWithCoverage) {
  EXPECT_EQ(EstimatedError(0.0, 4.0), 4.0);
  EXPECT_NEAR(EstimatedError(0.8, 4.0), 0.8 * 1.5 + 0.2 * 4.0, 1e-12);
}

TEST(ErrorModelTest, ShorterSchedulesCostError) {
  EXPECT_EQ(ErrorGrowth({1.0, 1.0}), 1.0);
  EXPECT_GT(ErrorGrowth({0.5, 1.0}), 1.0);
  EXPECT_GT(ErrorGrowth({0.2, 1.0}), ErrorGrowth({0.5, 1.0}));
  EXPECT_GT(ErrorGrowth({1.0, 0.2}), 1.0);
}

TEST(ErrorModelTest, PredictsNextOfLogNormalNumbers) {
  const std::vector<double> errors = {1.0, 2.0, 4.0};
  const ExpectedError next = PredictNext(errors);
  EXPECT_NEAR(next.error, 2.0, 1e-12);
  // t(0.9, 2) = 1.886, deviation ln 2, sqrt(1 + 1 / 3)
  EXPECT_NEAR(std::log(next.high / 2.0), 1.886 * std::log(2.0) * std::sqrt(4.0 / 3.0), 1e-9);
  EXPECT_NEAR(next.low * next.high, 4.0, 1e-9);
  const std::vector<double> two = {1.0, 2.0};
  EXPECT_THROW(PredictNext(two), Error);
}

TEST(ErrorModelTest, MoreKeyViewsAreExpectedToHelp) {
  const ExpectedError one = ExpectFromOtherScenes(1), two = ExpectFromOtherScenes(2),
                      four = ExpectFromOtherScenes(4);
  EXPECT_NEAR(two.error / one.error, 0.91, 0.02);
  EXPECT_NEAR(four.error / one.error, 0.85, 0.02);
}

TEST(ErrorModelTest, KnowledgeNarrowsTheInterval) {
  const auto width = [](const ExpectedError& e) { return e.high / e.low; };
  EXPECT_LT(width(ExpectFromScore(2.0)), width(ExpectFromEstimate(2.0)));
  EXPECT_LT(width(ExpectFromEstimate(2.0)), width(ExpectFromOtherScenes(1)));
}

// Each scene predicted from the others: the intervals hold about four of five, and no better is
// claimed (core/METHOD.md has the table).
TEST(ErrorModelTest, IntervalsHoldScenesLeftOut) {
  int held = 0;
  for (const CalibrationScene& scene : CalibrationScenes()) {
    std::vector<double> others;
    for (const CalibrationScene& other : CalibrationScenes()) {
      if (std::string(other.name) != scene.name) others.push_back(other.error);
    }
    const ExpectedError expected = PredictNext(others);
    held += scene.error > expected.low && scene.error < expected.high;
    RecordProperty(scene.name, std::to_string(expected.error));
  }
  const auto scenes = static_cast<int>(CalibrationScenes().size());
  EXPECT_GE(5 * held, 3 * scenes);
}

TEST(ErrorModelTest, EstimatesOfRunsLeftOutAreWithinTheirIntervals) {
  int held = 0;
  for (const CalibrationRun& run : CalibrationRuns()) {
    std::vector<double> ratios;
    for (const CalibrationRun& other : CalibrationRuns()) {
      if (std::string(other.scene) == run.scene) continue;
      ratios.push_back(other.error / EstimatedError(other.carried_share, other.uncovered_error));
    }
    const ExpectedError expected =
        PredictNext(ratios).Times(EstimatedError(run.carried_share, run.uncovered_error));
    held += run.error > expected.low && run.error < expected.high;
    EXPECT_LT(std::abs(std::log(run.error / expected.error)), std::log(2.0)) << run.name;
  }
  const auto runs = static_cast<int>(CalibrationRuns().size());
  EXPECT_GE(5 * held, 3 * runs);
}

}  // namespace
}  // namespace color3d
