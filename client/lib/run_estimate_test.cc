#include "client/lib/run_estimate.h"

#include <gtest/gtest.h>

namespace color3d::client {
namespace {

v1::Job Reporting(const char* kind, const char* error_name, double value) {
  v1::Job job;
  job.set_kind(kind);
  job.mutable_progress()->set_error_name(error_name);
  job.mutable_progress()->set_error_value(value);
  return job;
}

TEST(RunEstimateTest, IsUnknownUntilColorizerIsValidated) {
  RunEstimate estimate;
  estimate.OnJob(Reporting("carry_color", "coverage", 0.5));
  EXPECT_FALSE(estimate.error().has_value());
  EXPECT_EQ(estimate.Text(), "");
  estimate.OnJob(Reporting("personalize", "train_l1_ab", 9.0));
  EXPECT_FALSE(estimate.error().has_value());
}

TEST(RunEstimateTest, FallsWithCoverageAndValidation) {
  RunEstimate estimate;
  estimate.OnJob(Reporting("personalize", "validation_delta_e00", 9.0));
  EXPECT_EQ(estimate.error(), 9.0) << "nothing is carried";
  estimate.OnJob(Reporting("carry_color", "coverage", 0.8));
  const double carried = *estimate.error();
  EXPECT_LT(carried, 9.0);
  estimate.OnJob(Reporting("personalize", "validation_delta_e00", 4.0));
  EXPECT_LT(*estimate.error(), carried);
  EXPECT_EQ(estimate.Text(), "estimated error 2.0");
}

TEST(RunEstimateTest, IsReplacedWhenChromaIsSolved) {
  RunEstimate estimate;
  estimate.OnJob(Reporting("carry_color", "coverage", 0.5));
  estimate.OnJob(Reporting("solve_chroma", "view_disagreement_ab", 1.0));
  EXPECT_FALSE(estimate.error().has_value()) << "no colorizer was validated";
  estimate.OnJob(Reporting("personalize", "validation_delta_e00", 4.0));
  EXPECT_EQ(estimate.error(), EstimatedError({0.5, 4.0, 1.0}));
}

TEST(RunEstimateTest, IgnoresErrorsOfOtherStages) {
  RunEstimate estimate;
  estimate.OnJob(Reporting("personalize", "validation_delta_e00", 4.0));
  estimate.OnJob(Reporting("solve_chroma", "coverage", 0.9));
  estimate.OnJob(Reporting("evaluate", "validation_delta_e00", 1.0));
  EXPECT_EQ(estimate.error(), 4.0);
}

TEST(RunEstimateTest, IsUnknownAfterCachedCarry) {
  RunEstimate estimate;
  v1::Job carry = Reporting("carry_color", "", 0.0);
  carry.set_state(v1::Job::STATE_SUCCEEDED);
  estimate.OnJob(carry);
  estimate.OnJob(Reporting("personalize", "validation_delta_e00", 4.0));
  EXPECT_FALSE(estimate.error().has_value());
}

}  // namespace
}  // namespace color3d::client
