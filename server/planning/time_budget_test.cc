#include "server/planning/time_budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/catalogue/stages.h"
#include "server/planning/job_spec.h"
#include "server/planning/spec_check.h"
#include "tests/support/service/planned_graphs.h"

namespace color3d {
namespace {
using ::testing::HasSubstr;

TEST(Planner, TimeBudgetIsDividedAmongTheStagesThatCanEndEarlier) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(90);
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  const double geometry =
      SpecOf(graph, "reconstruct_geometry").reconstruct_geometry().time_limit_seconds();
  const double personalize = SpecOf(graph, "personalize").personalize().time_limit_seconds();
  const double chroma = SpecOf(graph, "solve_chroma").solve_chroma().time_limit_seconds();
  EXPECT_GT(geometry, 5.0);
  EXPECT_GT(personalize, geometry);
  EXPECT_GT(chroma, 1.0);
  EXPECT_NEAR(geometry + personalize + chroma + FixedSeconds(kTwentyPhotos), 90.0, 1e-6);
}

TEST(Planner, ASplatsGeometryTakesNoTime) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(90);
  const SceneFacts splat = {.photos = kSplatViews, .has_poses = true, .is_splat = true};
  const NewGraph graph = PlanJob(spec, {}, splat);
  const double personalize = SpecOf(graph, "personalize").personalize().time_limit_seconds();
  const double chroma = SpecOf(graph, "solve_chroma").solve_chroma().time_limit_seconds();
  EXPECT_NEAR(personalize + chroma + FixedSeconds(splat), 90.0, 1e-6);
}

TEST(Planner, AShareOfALongBudgetIsNoMoreThanAStagesLimitMayBe) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(604'800);
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  for (const char* kind : {"reconstruct_geometry", "personalize", "solve_chroma"}) {
    EXPECT_NO_THROW(CheckSpec(SpecOf(graph, kind))) << kind;
  }
}

TEST(Planner, ExactlyTheStagesThatKeepATimeLimitGetAShareOfTheBudget) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(90);
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  for (const Stage& stage : StageCatalogue()) {
    if (std::string_view(stage.kind) == kind::kPersonalizeScenes) continue;
    v1::JobSpec planned = SpecOf(graph, stage.kind);
    const google::protobuf::Message* options = MutableStage(&planned, stage.kind);
    const auto* limit = options->GetDescriptor()->FindFieldByName("time_limit_seconds");
    const bool limited = limit != nullptr && options->GetReflection()->HasField(*options, limit);
    EXPECT_EQ(limited, stage.keeps_time_limit) << stage.kind;
  }
}

TEST(Planner, AStagesOwnTimeLimitWinsOverTheBudget) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(90);
  spec.mutable_colorize_scene()->mutable_reconstruct_geometry()->set_time_limit_seconds(3);
  EXPECT_EQ(SpecOf(PlanJob(spec, {}, kTwentyPhotos), "reconstruct_geometry")
                .reconstruct_geometry()
                .time_limit_seconds(),
            3.0);
}

TEST(Planner, RefusesABudgetThatTheSceneCannotMeetAndNamesTheLeast) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(20);
  const Thrown thrown = PlanError(spec);
  EXPECT_EQ(thrown.code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(thrown.reason, "BAD_OPTION");
  EXPECT_THAT(thrown.message, HasSubstr("20 photos"));
  EXPECT_THAT(thrown.message, HasSubstr("at least"));
}

}  // namespace
}  // namespace color3d
