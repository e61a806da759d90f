#include "client/lib/plan_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace color3d::client {
namespace {
using ::testing::HasSubstr;
using ::testing::Not;

v1::JobPlan SomePlan() {
  v1::JobPlan plan;
  const auto add =
      [&](const char* kind, bool runs, const char* reason, double seconds, int64_t mb) {
        v1::PlannedStage* stage = plan.add_stages();
        stage->set_kind(kind);
        stage->set_runs(runs);
        stage->set_reason(reason);
        stage->set_expected_seconds(seconds);
        stage->set_expected_peak_memory_bytes(1'000'000 * mb);
      };
  add("carry_color", true, "colours are carried", 12.0, 300);
  add("correct_colors", false, "no corrections were given", 0.0, 0);
  add("solve_chroma", false, "frames are not reconstructed", 27.0, 560);
  plan.set_expected_seconds(12.0);
  plan.set_saved_seconds(27.0);
  plan.set_machine_factor(1.0);
  plan.set_expected_peak_memory_bytes(300'000'000);
  plan.set_saved_memory_bytes(560'000'000);
  return plan;
}

TEST(PlanTextTest, NamesStagesReasonsAndSeconds) {
  const std::string text = PlanText(SomePlan());
  EXPECT_THAT(text, HasSubstr("carry color"));
  EXPECT_THAT(text, HasSubstr("colours are carried"));
  EXPECT_THAT(text, HasSubstr("frames are not reconstructed"));
  EXPECT_THAT(text, HasSubstr("expected: 12 s of computing; 27 s saved"));
  EXPECT_LT(text.find("carry color"), text.find("left out"));
  EXPECT_GT(text.find("solve chroma"), text.find("left out"));
}

TEST(PlanTextTest, NamesMemory) {
  v1::JobPlan plan = SomePlan();
  EXPECT_THAT(PlanText(plan), HasSubstr("memory"));
  EXPECT_THAT(PlanText(plan), HasSubstr("expected peak memory: 300.0 MB; 560.0 MB saved\n"));
  plan.set_saved_memory_bytes(0);
  EXPECT_THAT(PlanText(plan), HasSubstr("expected peak memory: 300.0 MB\n"));
  plan.set_expected_peak_memory_bytes(0);
  EXPECT_THAT(PlanText(plan), Not(HasSubstr("peak memory"))) << "of an older server";
}

TEST(PlanTextTest, SaysHowSpeedOfServerIsKnown) {
  v1::JobPlan plan = SomePlan();
  EXPECT_THAT(PlanText(plan), HasSubstr("has not run enough jobs"));
  plan.set_machine_factor(2.5);
  plan.set_measured_jobs(9);
  EXPECT_THAT(PlanText(plan), HasSubstr("2.5 times"));
  EXPECT_THAT(PlanText(plan), HasSubstr("9 jobs"));
}

TEST(PlanTextTest, OmitsHeadingWithoutStagesLeftOut) {
  v1::JobPlan plan = SomePlan();
  plan.mutable_stages()->DeleteSubrange(1, 2);
  plan.set_saved_seconds(0.0);
  plan.set_saved_memory_bytes(0);
  EXPECT_THAT(PlanText(plan), Not(HasSubstr("left out")));
  EXPECT_THAT(PlanText(plan), Not(HasSubstr("saved")));
}

TEST(PlanTextTest, TellsExpectedErrorsOfBudgets) {
  v1::JobPlan plan = SomePlan();
  EXPECT_THAT(PlanText(plan), Not(HasSubstr("expected error")));
  plan.set_shortest_budget_seconds(41.0);
  plan.set_error_basis(v1::ERROR_BASIS_OTHER_SCENES);
  v1::BudgetError* row = plan.add_budget_errors();
  row->set_budget_seconds(30.0);
  row->set_too_short(true);
  row = plan.add_budget_errors();
  row->set_budget_seconds(60.0);
  row->set_error(3.14);
  row->set_low(1.62);
  row->set_high(6.08);
  const std::string text = PlanText(plan);
  EXPECT_THAT(text, HasSubstr("too short, at least 41 s"));
  EXPECT_THAT(text, HasSubstr("3.1 (1.6 to 6.1)"));
  EXPECT_THAT(text, HasSubstr("errors of other scenes"));
  plan.set_error_basis(v1::ERROR_BASIS_SCORE);
  plan.set_error_job("jobs/7");
  EXPECT_THAT(PlanText(plan), HasSubstr("by the score of jobs/7 against true colours"));
}

TEST(PlanTextTest, ComparesWithMeasuredSeconds) {
  EXPECT_TRUE(IsWithinAThird(41.0, 60.0));
  EXPECT_TRUE(IsWithinAThird(79.0, 60.0));
  EXPECT_FALSE(IsWithinAThird(39.0, 60.0));
  EXPECT_FALSE(IsWithinAThird(81.0, 60.0));
  EXPECT_EQ(PlanCheckText(54.0, 57.0), "expected 54 s of computing, took 57 s");
  EXPECT_THAT(PlanCheckText(20.0, 57.0), HasSubstr("more than a third off"));
}

TEST(PlanTextTest, ComparesWithMeasuredMemory) {
  EXPECT_EQ(MemoryCheckText(900'000'000, 870'000'000),
            "expected a peak memory of 900.0 MB, measured 870.0 MB");
  EXPECT_THAT(MemoryCheckText(200'000'000, 870'000'000), HasSubstr("large photos need more"));
  EXPECT_THAT(MemoryCheckText(6'500'000'000, 1'200'000'000), HasSubstr("maximum number"));
}

}  // namespace
}  // namespace color3d::client
