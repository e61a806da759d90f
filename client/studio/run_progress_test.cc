#include "client/studio/run_progress.h"

#include <gtest/gtest.h>

namespace color3d::client {
namespace {

v1::Job ColorizeJob() {
  v1::Job job;
  job.set_name("jobs/1");
  job.set_kind("colorize_scene");
  job.set_state(v1::Job::STATE_BLOCKED);
  job.mutable_spec()->set_scene("scenes/a");
  job.mutable_spec()->mutable_colorize_scene()->set_key_view("0003.jpg");
  return job;
}

v1::JobPlan Plan() {
  v1::JobPlan plan;
  for (const auto& [kind, seconds] :
       {std::pair("import_scene", 4.0), std::pair("personalize", 30.0)}) {
    v1::PlannedStage* stage = plan.add_stages();
    stage->set_kind(kind);
    stage->set_runs(true);
    stage->set_expected_seconds(seconds);
  }
  return plan;
}

v1::JobEvent StageEvent(const char* name, const char* kind, v1::Job::State state) {
  v1::JobEvent event;
  event.set_kind(v1::JobEvent::KIND_STATE);
  event.mutable_job()->set_name(name);
  event.mutable_job()->set_parent("jobs/1");
  event.mutable_job()->set_kind(kind);
  event.mutable_job()->set_state(state);
  return event;
}

TEST(RunProgressTest, TellsStagesInTheirOrderWithTimeLeft) {
  RunProgress run(ColorizeJob(), Plan());
  run.OnEvent(StageEvent("jobs/3", "personalize", v1::Job::STATE_BLOCKED));
  run.OnEvent(StageEvent("jobs/2", "import_scene", v1::Job::STATE_RUNNING));
  auto json = run.ToJson();
  EXPECT_EQ(json["id"], "1");
  EXPECT_EQ(json["key_view"], "0003.jpg");
  ASSERT_EQ(json["stages"].size(), 2u);
  EXPECT_EQ(json["stages"][0]["kind"], "import_scene");
  EXPECT_EQ(json["seconds_left"], 34.0);
  EXPECT_TRUE(json["expected_error"].is_null());

  v1::JobEvent progress = StageEvent("jobs/3", "personalize", v1::Job::STATE_RUNNING);
  progress.set_kind(v1::JobEvent::KIND_PROGRESS);
  progress.mutable_job()->mutable_progress()->set_step(30);
  progress.mutable_job()->mutable_progress()->set_total_steps(60);
  progress.mutable_job()->mutable_progress()->set_eta_seconds(12);
  run.OnEvent(StageEvent("jobs/2", "import_scene", v1::Job::STATE_SUCCEEDED));
  run.OnEvent(progress);
  json = run.ToJson();
  EXPECT_EQ(json["seconds_left"], 12.0);
  EXPECT_EQ(json["stages"][1]["share"], 0.5);
  EXPECT_EQ(json["stages"][0]["share"], 1.0);
}

TEST(RunProgressTest, ListsPicturesOfFinishedStagesAndReasons) {
  RunProgress run(ColorizeJob(), std::nullopt);
  v1::JobEvent colored = StageEvent("jobs/2", "colorize_key_view", v1::Job::STATE_SUCCEEDED);
  v1::Artifact* picture = colored.mutable_job()->add_artifacts();
  picture->set_name("key_view_colored.png");
  picture->set_media_type("image/png");
  colored.mutable_job()->add_artifacts()->set_media_type("application/json");
  run.OnEvent(colored);
  v1::JobEvent failed = StageEvent("jobs/1", "colorize_scene", v1::Job::STATE_FAILED);
  failed.mutable_job()->mutable_error()->set_message("the disk is full");
  run.OnEvent(failed);
  run.OnEvent({});  // still here
  const auto json = run.ToJson();
  ASSERT_EQ(json["pictures"].size(), 1u);
  EXPECT_EQ(json["pictures"][0]["job"], "2");
  EXPECT_EQ(json["state"], "FAILED");
  EXPECT_EQ(json["error"], "the disk is full");
}

}  // namespace
}  // namespace color3d::client
