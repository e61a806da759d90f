#include "server/rpc/jobs/error_forecast.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "core/catalogue/stages.h"
#include "server/planning/job_plan.h"
#include "server/planning/time_budget.h"
#include "tests/support/service/job_store_fixture.h"
#include "tests/support/service/planned_graphs.h"

namespace color3d {
namespace {

v1::JobSpec AutomaticSpec() {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  spec.mutable_colorize_scene()->mutable_key_color()->set_automatic(true);
  return spec;
}

v1::JobPlan PlanWithErrors(const v1::JobSpec& spec, const ErrorForecast& forecast) {
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  v1::JobPlan plan = DescribeGraph(graph, kTwentyPhotos, {}, {});
  AddBudgetErrors(forecast, spec, graph, kTwentyPhotos, {}, &plan);
  return plan;
}

TEST(BudgetErrorsTest, FallWithTheBudget) {
  v1::JobSpec spec = AutomaticSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(45.0);
  const v1::JobPlan plan = PlanWithErrors(spec, {ExpectFromScore(2.0)});
  const double shortest = ShortestTimeBudget(kTwentyPhotos, {});
  EXPECT_EQ(plan.shortest_budget_seconds(), shortest);
  ASSERT_GT(shortest, 30.0);
  ASSERT_LT(shortest, 45.0);
  ASSERT_EQ(plan.budget_errors_size(), 5) << "four, and that of the spec";
  EXPECT_TRUE(plan.budget_errors(0).too_short());
  EXPECT_EQ(plan.budget_errors(1).budget_seconds(), 45.0);
  for (int i = 1; i < 5; ++i) {
    const v1::BudgetError& row = plan.budget_errors(i);
    EXPECT_FALSE(row.too_short());
    EXPECT_LT(row.low(), row.error());
    EXPECT_GT(row.high(), row.error());
    if (i > 1) {
      EXPECT_LE(row.error(), plan.budget_errors(i - 1).error());
    }
  }
  EXPECT_GT(plan.budget_errors(1).error(), plan.budget_errors(3).error());
  EXPECT_DOUBLE_EQ(plan.budget_errors(4).error(), 2.0) << "300 s hold the whole schedules";
}

TEST(BudgetErrorsTest, SlowMachineShortensSchedules) {
  const v1::JobSpec spec = AutomaticSpec();
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  v1::JobPlan plan = DescribeGraph(graph, kTwentyPhotos, {}, {.factor = 10.0, .jobs = 5});
  AddBudgetErrors({ExpectFromScore(2.0)}, spec, graph, kTwentyPhotos, {}, &plan);
  EXPECT_GT(plan.budget_errors(2).error(), 2.0);
}

TEST(BudgetErrorsTest, AreLeftOutWithoutColorizer) {
  v1::JobSpec spec = AutomaticSpec();
  spec.mutable_colorize_scene()->mutable_colorize_views()->set_method(
      v1::ColorizeViewsSpec::METHOD_GRAY);
  const v1::JobPlan plan = PlanWithErrors(spec, {ExpectFromOtherScenes(1)});
  EXPECT_EQ(plan.budget_errors_size(), 0);
  EXPECT_EQ(plan.shortest_budget_seconds(), 0.0);
}

class ErrorForecastTest : public JobStoreTest {
 protected:
  using Reported = std::map<std::string, std::pair<std::string, double>>;  // by kind of stage

  ErrorForecast Forecast(const v1::JobSpec& spec) {
    return ForecastError(spec, ProjectStore(*store_, ""));
  }
  // Runs all stages of the spec; each reports one error.
  std::string Run(const v1::JobSpec& spec, const Reported& errors) {
    const std::string root =
        store_->CreateGraph(PlanJob(spec, {}, kTwentyPhotos), {}, kNoLimit).name;
    while (const std::optional<JobRecord> job = store_->Claim("w", kLease)) {
      ProgressRecord progress;
      if (const auto found = errors.find(job->kind); found != errors.end()) {
        progress.error_name = found->second.first;
        progress.error_value = found->second.second;
      }
      store_->Heartbeat(LeaseOf(*job), progress, {}, kLease);
      Succeed(*job);
    }
    EXPECT_EQ(StateOf(root), JobState::kSucceeded);
    return root;
  }
};

const std::pair<std::string, double> kCovered{"coverage", 0.5},
    kValidated{"validation_delta_e00", 3.0};

TEST_F(ErrorForecastTest, KnowsOtherScenesOnlyAtFirst) {
  const ErrorForecast forecast = Forecast(AutomaticSpec());
  EXPECT_EQ(forecast.basis, v1::ERROR_BASIS_OTHER_SCENES);
  EXPECT_EQ(forecast.job, "");
  EXPECT_GT(forecast.error.high, 2.0 * forecast.error.low);
}

TEST_F(ErrorForecastTest, UsesEstimateOfEarlierRun) {
  const std::string run =
      Run(AutomaticSpec(), {{kind::kCarryColor, kCovered}, {kind::kPersonalize, kValidated}});
  const ErrorForecast forecast = Forecast(AutomaticSpec());
  EXPECT_EQ(forecast.basis, v1::ERROR_BASIS_ESTIMATE);
  EXPECT_EQ(forecast.job, run);
  EXPECT_EQ(forecast.error.error, ExpectFromRun({0.5, 3.0, std::nullopt}).error);
  Run(AutomaticSpec(),
      {{kind::kCarryColor, kCovered},
       {kind::kPersonalize, kValidated},
       {kind::kSolveChroma, {"view_disagreement_ab", 1.2}}});
  EXPECT_EQ(Forecast(AutomaticSpec()).error.error, ExpectFromRun({0.5, 3.0, 1.2}).error);
}

TEST_F(ErrorForecastTest, PrefersScoreOverEstimate) {
  Run(AutomaticSpec(),
      {{kind::kCarryColor, kCovered},
       {kind::kPersonalize, kValidated},
       {kind::kEvaluate, {"delta_e00_chroma", 1.7}}});
  const ErrorForecast forecast = Forecast(AutomaticSpec());
  EXPECT_EQ(forecast.basis, v1::ERROR_BASIS_SCORE);
  EXPECT_EQ(forecast.error.error, 1.7);
}

TEST_F(ErrorForecastTest, IgnoresRunsWithOtherKeyViews) {
  Run(AutomaticSpec(), {{kind::kEvaluate, {"delta_e00_chroma", 1.7}}});
  v1::JobSpec other = AutomaticSpec();
  other.mutable_colorize_scene()->set_key_view("b.jpg");
  EXPECT_EQ(Forecast(other).basis, v1::ERROR_BASIS_OTHER_SCENES);
  other = AutomaticSpec();
  other.mutable_colorize_scene()->mutable_select_key_view()->set_count(2);
  EXPECT_EQ(Forecast(other).basis, v1::ERROR_BASIS_OTHER_SCENES);
}

}  // namespace
}  // namespace color3d
