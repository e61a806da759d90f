#include "server/planning/plan_scenes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/base/service_error.h"

namespace color3d {
namespace {
using ::testing::HasSubstr;

SceneRouteInputs RouteInputs(const std::string& scene) {
  SceneRouteInputs inputs;
  int64_t id = 0;
  for (const char* kind : {"import_scene", "select_key_view", "colorize_key_view"}) {
    JobRecord job;
    job.id = ++id;
    job.name = "jobs/" + std::string(kind) + "-" + scene.substr(7);
    job.kind = kind;
    job.scene = scene;
    job.state = JobState::kSucceeded;
    inputs.jobs.push_back(job);
  }
  inputs.facts = {.pictures = 20, .layout = CaptureLayout::kColmap};
  return inputs;
}

v1::JobSpec SpecOf(const std::vector<std::string>& scenes) {
  v1::JobSpec spec;
  spec.set_scene(scenes.empty() ? "scenes/none" : scenes[0]);
  spec.set_seed(7);
  spec.mutable_personalize_scenes()->mutable_options()->set_iterations(5);
  for (const std::string& scene : scenes) {
    spec.mutable_personalize_scenes()->add_routes()->set_scene(scene);
  }
  return spec;
}

TEST(PlanScenes, EachSceneHasItsPersonalizeJob) {
  const NewGraph graph = PlanPersonalizeScenes(SpecOf({"scenes/a", "scenes/b"}),
                                               {RouteInputs("scenes/a"), RouteInputs("scenes/b")});
  ASSERT_EQ(graph.jobs.size(), 3u);
  for (int i = 0; i < 2; ++i) {
    const NewJob& job = graph.jobs[i];
    const std::string scene = i == 0 ? "scenes/a" : "scenes/b";
    EXPECT_EQ(job.kind, "personalize");
    EXPECT_EQ(job.scene, scene);
    ASSERT_EQ(job.input_jobs.size(), 3u);
    for (const std::string& input : job.input_jobs)
      EXPECT_THAT(input, HasSubstr("-" + scene.substr(7)));
    v1::JobSpec spec;
    ASSERT_TRUE(spec.ParseFromString(job.spec));
    EXPECT_EQ(spec.personalize().iterations(), 5);
    EXPECT_EQ(spec.seed(), 7u);
  }
  EXPECT_EQ(graph.jobs[2].kind, "personalize_scenes");
  EXPECT_EQ(graph.jobs[2].inputs, (std::vector<int>{0, 1}));
}

TEST(PlanScenes, RefusesNoSceneAndRepeatedScenes) {
  const auto message = [](const std::vector<std::string>& scenes) -> std::string {
    try {
      PlanPersonalizeScenes(SpecOf(scenes), {RouteInputs("scenes/a"), RouteInputs("scenes/a")});
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(message({}), HasSubstr("routes is empty"));
  EXPECT_THAT(message({"scenes/a", "scenes/a"}), HasSubstr("again"));
}

TEST(PlanScenes, RefusesAFailedKeyColor) {
  SceneRouteInputs inputs = RouteInputs("scenes/a");
  inputs.jobs[2].state = JobState::kFailed;
  EXPECT_THROW(PlanPersonalizeScenes(SpecOf({"scenes/a"}), {inputs}), Error);
}

}  // namespace
}  // namespace color3d
