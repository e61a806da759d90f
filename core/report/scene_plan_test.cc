#include "core/report/scene_plan.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace color3d {
namespace {

TEST(ScenePlan, LeavesOutWhatTheSceneDoesNotNeed) {
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

TEST(ScenePlan, TellsOfTime) {
  const auto told = [](const PlanFacts& facts) {
    for (const PlanStep& step : PlanScene(facts)) {
      if (step.step == "deformation_over_time") return step;
    }
    return PlanStep{};
  };
  EXPECT_FALSE(told({}).needed);
  const PlanStep step = told({.is_dynamic = true, .time_steps = 25, .cameras = 4});
  EXPECT_TRUE(step.needed);
  EXPECT_EQ(step.reason, "the views show 25 moments, seen by 4 cameras");
  EXPECT_FALSE(told({.is_film = true, .is_dynamic = true}).needed);
}

TEST(ScenePlan, TellsWhatTheGeometryHasDecided) {
  const auto told = [](const SceneMotion& motion) {
    for (auto& step : nlohmann::json::parse(PlanToJson(
             PlanScene({.is_dynamic = true, .time_steps = 9, .cameras = 1, .motion = motion})))) {
      if (step.at("step") == "deformation_over_time") return step;
    }
    return nlohmann::json();
  };
  const auto still = told({false, 0.001});
  EXPECT_EQ(still.at("needed"), false);
  EXPECT_EQ(still.at("motion"), "static");
  EXPECT_EQ(still.at("moving_share"), 0.001);
  EXPECT_EQ(still.at("reason"),
            "the views show 9 moments, seen by 1 camera; static: nothing moves in their geometry");
  const auto partly = told({true, 0.031});
  EXPECT_EQ(partly.at("needed"), true);
  EXPECT_EQ(partly.at("motion"), "partly dynamic");
  EXPECT_EQ(partly.at("reason"),
            "the views show 9 moments, seen by 1 camera; partly dynamic: 3.1 % of the pixels move");
  EXPECT_EQ(told({true, 0.5}).at("motion"), "fully dynamic");
  const auto unmeasured = told({true, {}});
  EXPECT_EQ(unmeasured.at("needed"), true);
  EXPECT_FALSE(unmeasured.contains("motion"));
  EXPECT_FALSE(unmeasured.contains("moving_share"));
}

}  // namespace
}  // namespace color3d
