// The jobs that colour additional key views.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/catalogue/limits.h"
#include "core/catalogue/stages.h"
#include "proto/option_text.h"
#include "server/planning/job_spec.h"
#include "server/planning/key_view_jobs.h"
#include "server/planning/planner.h"
#include "tests/support/service/planned_graphs.h"

namespace color3d {
namespace {
using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::FurtherKeyView* AddKeyView(const std::string& view, v1::CarryColorSpec* carry) {
  v1::FurtherKeyView* key = carry->add_further_key_views();
  key->set_view(view);
  *key->mutable_color()->mutable_image() = SomeDigest(view);
  return key;
}

// The specs of the colorize_key_view jobs that the job of this kind reads, in their order.
std::vector<v1::ColorizeKeyViewSpec> KeyViewsRead(const NewGraph& graph, const std::string& kind) {
  std::vector<v1::ColorizeKeyViewSpec> read;
  std::vector<int> inputs = graph.jobs[IndexOf(graph, kind)].inputs;
  std::sort(inputs.begin(), inputs.end());
  for (const int input : inputs) {
    if (graph.jobs[input].kind != kind::kColorizeKeyView) continue;
    read.push_back(ParseSpec(graph.jobs[input].spec, "test").colorize_key_view());
  }
  return read;
}

TEST(Planner, EachAdditionalKeyViewIsAJob) {
  v1::JobSpec spec = SceneSpec();
  v1::ColorizeSceneSpec* scene = spec.mutable_colorize_scene();
  AddKeyView("b", scene->mutable_carry_color());
  AddKeyView("a.jpg", scene->mutable_carry_color());
  scene->mutable_colorize_key_view()->set_hint_sigma(2.0);
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  EXPECT_EQ(graph.jobs.size(), 16u);
  EXPECT_EQ(graph.jobs.back().inputs.size(), 15u) << "the report reads them, too";
  const auto keys = KeyViewsRead(graph, kind::kCarryColor);
  ASSERT_EQ(keys.size(), 3u);
  EXPECT_EQ(keys[0].view(), "") << "the selected one";
  EXPECT_EQ(keys[0].hint_sigma(), 2.0);
  EXPECT_EQ(keys[1].view(), "b");
  EXPECT_EQ(keys[1].source().image().sha256(), Sha256Hex("b"));
  EXPECT_FALSE(keys[1].has_hint_sigma()) << "an option of the key view alone";
  EXPECT_EQ(keys[2].view(), "a.jpg");
  const v1::CarryColorSpec carry = SpecOf(graph, kind::kCarryColor).carry_color();
  ASSERT_EQ(carry.further_key_views_size(), 2);
  EXPECT_EQ(carry.further_key_views(1).view(), "a.jpg");
  EXPECT_FALSE(carry.further_key_views(1).has_color()) << "carry_color knows no sources";
  EXPECT_TRUE(graph.jobs[IndexOf(graph, kind::kCarryColor)].blobs.empty());
  EXPECT_EQ(KeyViewsRead(graph, kind::kPersonalize).size(), 1u);
  for (const NewJob& job : graph.jobs) {
    if (!ColorsAdditionalKeyView(ParseSpec(job.spec, job.kind))) continue;
    ASSERT_EQ(job.inputs.size(), 1u) << "it waits for no selection";
    EXPECT_EQ(graph.jobs[job.inputs[0]].kind, kind::kImportScene);
    EXPECT_EQ(job.blobs.size(), 1u);
  }
  scene->mutable_colorize_key_view()->set_view("c");
  EXPECT_THAT(PlanError(spec).message, HasSubstr("colorize_key_view.view is set"));
}

TEST(Planner, JointTrainingReadsAllKeyViews) {
  v1::JobSpec spec = SceneSpec();
  v1::ColorizeSceneSpec* scene = spec.mutable_colorize_scene();
  AddKeyView("b", scene->mutable_carry_color());
  AddKeyView("a", scene->mutable_carry_color());
  const auto read = [&](const char* kind) {
    std::vector<std::string> views;
    for (const auto& key : KeyViewsRead(PlanJob(spec, {}, kTwentyPhotos), kind)) {
      views.push_back(key.view());
    }
    return views;
  };
  EXPECT_THAT(read(kind::kPersonalize), ElementsAre("")) << "carried by default";
  for (const bool paper : {true, false}) {
    scene->set_preset(paper ? v1::PRESET_PAPER : v1::PRESET_FAST);
    if (!paper) scene->mutable_carry_color()->set_train_jointly(true);
    EXPECT_THAT(read(kind::kPersonalize), ElementsAre("", "b", "a"));
    EXPECT_THAT(read(kind::kColorizeViews), ElementsAre("", "b", "a"));
    const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
    EXPECT_NE(graph.jobs[IndexOf(graph, kind::kCarryColor)].skip_reason, "");
    EXPECT_EQ(graph.jobs.size(), 16u);
  }
  scene->mutable_carry_color()->set_skip(false);
  EXPECT_THAT(read(kind::kCarryColor), ElementsAre("", "b", "a"));
  EXPECT_THAT(read(kind::kPersonalize), ElementsAre(""));
}

TEST(Planner, RefusesJointTrainingInACarryJob) {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  spec.mutable_carry_color()->set_train_jointly(true);
  EXPECT_THAT(PlanError(spec).message, HasSubstr("carry_color.train_jointly is set"));
}

TEST(Planner, AdditionalKeyViewsOfACarryJobAreColoredFirst) {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  AddKeyView("b", spec.mutable_carry_color());
  std::vector<JobRecord> inputs;
  for (const char* kind :
       {"import_scene", "select_key_view", "colorize_key_view", "reconstruct_geometry"}) {
    JobRecord input;
    input.name = std::string("jobs/") + kind;
    input.kind = kind;
    input.scene = "scenes/test";
    input.state = JobState::kSucceeded;
    inputs.push_back(input);
  }
  // Children of an earlier colorize_scene job, whose additional key view was another one.
  v1::JobSpec earlier;
  earlier.mutable_colorize_key_view()->set_view("c");
  inputs.push_back(inputs[2]);
  inputs.back().name = "jobs/c";
  inputs.back().spec = DeterministicBytes(earlier);
  const NewGraph graph = PlanJob(spec, inputs, kTwentyPhotos);
  ASSERT_EQ(graph.jobs.size(), 2u);
  EXPECT_EQ(KeyViewsRead(graph, kind::kCarryColor)[0].view(), "b");
  EXPECT_THAT(graph.jobs[0].input_jobs, ElementsAre("jobs/import_scene"));
  EXPECT_THAT(graph.jobs[1].input_jobs,
              ElementsAre("jobs/import_scene",
                          "jobs/select_key_view",
                          "jobs/colorize_key_view",
                          "jobs/reconstruct_geometry"));
}

TEST(Planner, LimitsOfKeyViewsAreThoseOfTheApi) {
  const auto* views = v1::CarryColorSpec::descriptor()->FindFieldByName("further_key_views");
  EXPECT_EQ(InfoOf(views).max_count(), kMaxAdditionalKeyViews);
  const auto* count = v1::SelectKeyViewSpec::descriptor()->FindFieldByName("count");
  EXPECT_EQ(InfoOf(count).max(), kMaxAdditionalKeyViews + 1);
}

TEST(PlanColorizeScene, ColorsAdditionalKeyViewsBesideAnAcceptedOne) {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  AddKeyView("b", spec.mutable_colorize_scene()->mutable_carry_color());
  spec.add_inputs("jobs/colorize_key_view");
  const std::vector<JobRecord> inputs{
      Done("import_scene"), Done("select_key_view"), Done("colorize_key_view")};
  const NewGraph graph = PlanJob(spec, inputs, kTwentyPhotos);
  const auto keys = KeyViewsRead(graph, kind::kCarryColor);
  ASSERT_EQ(keys.size(), 1u);
  EXPECT_EQ(keys[0].view(), "b");
  EXPECT_THAT(graph.jobs[IndexOf(graph, kind::kColorizeKeyView)].input_jobs,
              ElementsAre("jobs/import_scene"));
  EXPECT_THAT(graph.jobs[IndexOf(graph, kind::kCarryColor)].input_jobs,
              ElementsAre("jobs/import_scene", "jobs/select_key_view", "jobs/colorize_key_view"));
}

}  // namespace
}  // namespace color3d
