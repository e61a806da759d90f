#include "core/report/scene_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/catalogue/estimates.h"
#include "core/catalogue/stages.h"

namespace color3d {
namespace {

TEST(ScenePlanTest, OmitsUnneededSteps) {
  PlanFacts facts;
  facts.has_poses = true;
  facts.views = 20;
  const auto plan = PlanScene(facts);
  const auto json = nlohmann::json::parse(PlanToJson(plan));
  ASSERT_EQ(json.size(), plan.size());
  int left_out = 0;
  for (const PlanStep& s : plan) {
    EXPECT_FALSE(s.reason.empty()) << s.step;
    EXPECT_TRUE(s.step != "structure_from_motion" || !s.needed);
    EXPECT_TRUE(s.step != "luminance_geometry" || s.needed);
    left_out += !s.needed;
    const auto& told = json[static_cast<size_t>(&s - plan.data())];
    EXPECT_EQ(told.at("step"), s.step);
    EXPECT_EQ(told.at("needed"), s.needed);
    EXPECT_EQ(told.at("reason"), s.reason);
  }
  EXPECT_GE(left_out, 5);
  facts.has_poses = false;
  EXPECT_TRUE(PlanScene(facts)[0].needed);
}

TEST(ScenePlanTest, FileHasKnownMemoryOnly) {
  const auto json = nlohmann::json::parse(
      PlanToJson({{.step = "chroma", .estimated_memory_bytes = 900, .measured_memory_bytes = 870},
                  {.step = "corrections", .needed = false}}));
  EXPECT_EQ(json.at(0).at("estimated_memory_bytes"), 900);
  EXPECT_EQ(json.at(0).at("measured_memory_bytes"), 870);
  EXPECT_FALSE(json.at(1).contains("estimated_memory_bytes"));
  EXPECT_FALSE(json.at(1).contains("measured_memory_bytes"));
}

TEST(ScenePlanTest, NamesDecoderThatWasNotTrained) {
  const auto training = [](const PlanFacts& facts) {
    for (const PlanStep& step : PlanScene(facts)) {
      if (step.step == "decoder_training") return step;
    }
    return PlanStep{};
  };
  EXPECT_EQ(training({}).step, "");
  const PlanStep step = training({.untrained_decoder = UntrainedDecoder{0.125, 100}});
  EXPECT_FALSE(step.needed);
  EXPECT_EQ(step.reason,
            "the neighbours agree: a decoder would have 12.5 % of the inferred colours");
  EXPECT_GT(step.estimated_seconds, 1.0);
}

TEST(ScenePlanTest, HasOneStepPerStage) {
  const auto plan = PlanScene({});
  for (const Stage& stage : StageCatalogue()) {
    const std::string kind = stage.kind;
    if (kind == kind::kColorizeScene || kind == kind::kPersonalizeScenes) continue;
    EXPECT_EQ(
        std::count_if(
            plan.begin(), plan.end(), [&](const PlanStep& step) { return step.stage == kind; }),
        1)
        << kind;
  }
}

TEST(ScenePlanTest, NamesKeyViewStrategy) {
  const auto selection = [](const PlanFacts& facts) {
    for (const PlanStep& step : PlanScene(facts)) {
      if (step.step == "key_view_selection") return step;
    }
    return PlanStep{};
  };
  const PlanStep step = selection({.key_view_strategy = "the entropy of its similarities"});
  EXPECT_TRUE(step.needed);
  EXPECT_EQ(step.reason, "the key view is chosen by the entropy of its similarities");
  EXPECT_EQ(selection({}).reason, "the key view is chosen among the views");
  EXPECT_FALSE(selection({.key_view_given = true}).needed);
}

TEST(ScenePlanTest, EstimatesPosesLikeTimeBudget) {
  const auto plan = PlanScene({.views = 50});
  EXPECT_EQ(plan[0].step, "structure_from_motion");
  EXPECT_DOUBLE_EQ(plan[0].estimated_seconds, 50 * kPosesSecondsPerPhoto);
}

TEST(ScenePlanTest, OmitsSkippedStages) {
  auto plan = PlanScene({});
  const size_t steps = plan.size();
  SkipStep(kind::kCarryColor, "carry_color.skip is set", &plan);
  EXPECT_EQ(plan.size(), steps);
  for (const PlanStep& step : plan) {
    if (step.stage != kind::kCarryColor) continue;
    EXPECT_FALSE(step.needed);
    EXPECT_EQ(step.reason, "carry_color.skip is set");
  }
}

TEST(ScenePlanTest, ReportsTimeSteps) {
  const auto told = [](const PlanFacts& facts) {
    for (const PlanStep& step : PlanScene(facts)) {
      if (step.step == "deformation_over_time") return step;
    }
    return PlanStep{};
  };
  EXPECT_FALSE(told({}).needed);
  const PlanStep step = told({.time_steps = 25, .cameras = 4});
  EXPECT_TRUE(step.needed);
  EXPECT_EQ(step.reason, "the views show 25 time steps, seen by 4 cameras");
  EXPECT_FALSE(told({.kind = CaptureKind::kFilm, .time_steps = 25}).needed);
}

TEST(ScenePlanTest, ReportsMotionFoundByGeometry) {
  const auto told = [](const SceneMotion& motion) {
    for (auto& step : nlohmann::json::parse(
             PlanToJson(PlanScene({.time_steps = 9, .cameras = 1, .motion = motion})))) {
      if (step.at("step") == "deformation_over_time") return step;
    }
    return nlohmann::json();
  };
  const auto still = told({false, 0.001});
  EXPECT_EQ(still.at("needed"), false);
  EXPECT_EQ(still.at("motion"), "static");
  EXPECT_EQ(still.at("moving_share"), 0.001);
  EXPECT_EQ(
      still.at("reason"),
      "the views show 9 time steps, seen by 1 camera; static: nothing moves in their geometry");
  const auto partly = told({true, 0.031});
  EXPECT_EQ(partly.at("needed"), true);
  EXPECT_EQ(partly.at("motion"), "partly dynamic");
  EXPECT_EQ(
      partly.at("reason"),
      "the views show 9 time steps, seen by 1 camera; partly dynamic: 3.1 % of the pixels move");
  EXPECT_EQ(told({true, 0.5}).at("motion"), "fully dynamic");
  const auto unmeasured = told({true, {}});
  EXPECT_EQ(unmeasured.at("needed"), true);
  EXPECT_FALSE(unmeasured.contains("motion"));
  EXPECT_FALSE(unmeasured.contains("moving_share"));
}

}  // namespace
}  // namespace color3d
