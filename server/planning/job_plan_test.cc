#include "server/planning/job_plan.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "core/catalogue/stages.h"
#include "server/planning/job_spec.h"
#include "tests/support/service/planned_graphs.h"

namespace color3d {
namespace {
using ::testing::HasSubstr;

v1::JobPlan PlanOf(const v1::JobSpec& spec,
                   const SceneFacts& facts,
                   const MachineFactor& machine = {}) {
  const NewGraph graph = PlanJob(spec, {}, facts);
  return DescribeGraph(graph, facts, spec.colorize_scene().import_scene(), machine);
}

const v1::PlannedStage& StageIn(const v1::JobPlan& plan, const std::string& kind) {
  for (const v1::PlannedStage& stage : plan.stages()) {
    if (stage.kind() == kind) return stage;
  }
  ADD_FAILURE() << "no " << kind;
  return v1::PlannedStage::default_instance();
}

v1::JobSpec SpecWithKeyView() {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_key_view("a.jpg");
  return spec;
}

// Totals of tests/bench/RESULTS.md, which were measured with given key views. That the decoder need
// not be trained is found out during a run: cam01's is planned without it.
struct MeasuredRun {
  const char* scene;
  SceneFacts facts;
  double seconds;
  bool finds_poses_of_film = false;
  bool trains_decoder = true;
};

TEST(JobPlanTest, AgreesWithMeasuredRuns) {
  const MeasuredRun runs[] = {
      {"fern", {.pictures = 20, .layout = CaptureLayout::kColmap}, 25},
      {"fox", {.pictures = 50, .layout = CaptureLayout::kTransforms}, 44},
      {"banana", {.pictures = 14, .layout = CaptureLayout::kColmap}, 26},
      {"sceaux", {.pictures = 11, .layout = CaptureLayout::kColmap}, 22},
      {"head", {.pictures = 33, .layout = CaptureLayout::kPhotos}, 63},
      {"lady_running", {.pictures = 65, .layout = CaptureLayout::kFilm}, 31},
      {"man_walking", {.pictures = 24, .layout = CaptureLayout::kFilm}, 16},
      {"cam01", {.pictures = 25, .layout = CaptureLayout::kFilm}, 9, false, false},
      {"lady_running with poses", {.pictures = 65, .layout = CaptureLayout::kFilm}, 209, true}};
  for (const MeasuredRun& run : runs) {
    v1::JobSpec spec = SpecWithKeyView();
    if (run.finds_poses_of_film) {
      spec.mutable_colorize_scene()->mutable_import_scene()->set_film_poses(
          v1::ImportSceneSpec::FILM_POSES_AUTO);
    }
    if (!run.trains_decoder) {
      spec.mutable_colorize_scene()->mutable_personalize()->set_iterations(0);
    }
    EXPECT_NEAR(PlanOf(spec, run.facts).expected_seconds(), run.seconds, run.seconds / 3.0)
        << run.scene;
  }
}

// The stages that the plan says run are the jobs that are not skipped, in the same order.
TEST(JobPlanTest, EqualsGraph) {
  v1::JobSpec no_carry = SceneSpec();
  no_carry.mutable_colorize_scene()->mutable_carry_color()->set_skip(true);
  v1::JobSpec paper = SceneSpec();
  paper.mutable_colorize_scene()->set_preset(v1::PRESET_PAPER);
  v1::JobSpec best = SceneSpec();
  best.mutable_colorize_scene()->set_preset(v1::PRESET_BEST);
  const SceneFacts captures[] = {{.pictures = 20, .layout = CaptureLayout::kPhotos},
                                 {.pictures = 20, .layout = CaptureLayout::kColmap},
                                 {.layout = CaptureLayout::kSplat},
                                 {.pictures = 60, .layout = CaptureLayout::kFilm},
                                 {.pictures = 60, .layout = CaptureLayout::kFilms},
                                 {.pictures = 30, .layout = CaptureLayout::kNerfies}};
  for (const v1::JobSpec& spec : {SceneSpec(), SpecWithKeyView(), no_carry, paper, best}) {
    for (const SceneFacts& facts : captures) {
      const NewGraph graph = PlanJob(spec, {}, facts);
      const v1::JobPlan plan = DescribeGraph(graph, facts, {}, {});
      ASSERT_EQ(plan.stages_size() + 1, static_cast<int>(graph.jobs.size())) << "and the parent";
      double expected = 0.0, saved = 0.0;
      for (int i = 0; i < plan.stages_size(); ++i) {
        const v1::PlannedStage& stage = plan.stages(i);
        const NewJob& job = graph.jobs[static_cast<size_t>(i)];
        EXPECT_EQ(stage.kind(), job.kind);
        EXPECT_EQ(stage.runs(), job.skip_reason.empty());
        EXPECT_FALSE(stage.reason().empty()) << stage.kind();
        if (!stage.runs()) {
          EXPECT_EQ(stage.reason(), job.skip_reason);
        }
        EXPECT_TRUE(std::isfinite(stage.expected_seconds()) && stage.expected_seconds() >= 0.0);
        (stage.runs() ? expected : saved) += stage.expected_seconds();
      }
      EXPECT_NEAR(plan.expected_seconds(), expected, 1e-9);
      EXPECT_NEAR(plan.saved_seconds(), saved, 1e-9);
      EXPECT_GT(plan.expected_seconds(), 5.0);
    }
  }
}

TEST(JobPlanTest, LeavesOutReconstructionOfFilms) {
  const v1::JobPlan plan = PlanOf(SceneSpec(), {.pictures = 60, .layout = CaptureLayout::kFilm});
  EXPECT_FALSE(StageIn(plan, kind::kReconstructGeometry).runs());
  EXPECT_FALSE(StageIn(plan, kind::kSolveChroma).runs());
  EXPECT_TRUE(StageIn(plan, kind::kCarryColor).runs());
}

TEST(JobPlanTest, LeftOutStageSavesItsSeconds) {
  v1::JobSpec spec = SceneSpec();
  const v1::PlannedStage carried = StageIn(PlanOf(spec, kTwentyPhotos), kind::kCarryColor);
  spec.mutable_colorize_scene()->mutable_carry_color()->set_skip(true);
  const v1::JobPlan plan = PlanOf(spec, kTwentyPhotos);
  EXPECT_TRUE(carried.runs());
  EXPECT_FALSE(StageIn(plan, kind::kCarryColor).runs());
  EXPECT_NEAR(
      StageIn(plan, kind::kCarryColor).expected_seconds(), carried.expected_seconds(), 1e-9);
  EXPECT_GT(plan.saved_seconds(), 1.0);
}

TEST(JobPlanTest, JobsNeedTheMemoryOfThePlanAndTheirModels) {
  v1::JobSpec spec;
  spec.set_scene("scenes/a");
  spec.set_seed(1);
  v1::KeyColorSource* source = spec.mutable_colorize_scene()->mutable_key_color();
  source->set_automatic(true);
  source->set_model("ddcolor");
  spec.mutable_colorize_scene()->mutable_personalize()->set_encoder("convnext");
  const SceneFacts facts{.pictures = 20};
  NewGraph graph = PlanJob(spec, {}, facts);
  SetNeeds(facts, {}, &graph);
  const v1::JobPlan plan = DescribeGraph(graph, facts, {}, {});
  std::map<std::string, JobNeeds> needs;
  for (const NewJob& job : graph.jobs) needs[job.kind] = job.needs;
  for (const v1::PlannedStage& stage : plan.stages()) {
    if (!stage.runs()) continue;
    EXPECT_EQ(needs.at(stage.kind()).memory_bytes, stage.expected_peak_memory_bytes())
        << stage.kind();
  }
  EXPECT_EQ(needs.at(kind::kColorizeKeyView).models, std::vector<std::string>{"model ddcolor"});
  EXPECT_EQ(needs.at(kind::kPersonalize).models, std::vector<std::string>{"model convnext"});
  EXPECT_EQ(needs.at(kind::kPersonalize).batch_group, "convnext");
  EXPECT_TRUE(needs.at(kind::kColorizeScene).models.empty()) << "it only reports";
  EXPECT_EQ(needs.at(kind::kColorizeScene).memory_bytes, 0);
}

TEST(JobPlanTest, PeakMemoryIsMaximumOfStagesThatRun) {
  const v1::JobPlan plan = PlanOf(SceneSpec(), kTwentyPhotos);
  int64_t peak = 0;
  for (const v1::PlannedStage& stage : plan.stages()) {
    if (!stage.runs()) continue;
    EXPECT_GT(stage.expected_peak_memory_bytes(), int64_t{100} << 20) << stage.kind();
    peak = std::max(peak, stage.expected_peak_memory_bytes());
  }
  EXPECT_EQ(plan.expected_peak_memory_bytes(), peak);
  EXPECT_EQ(plan.saved_memory_bytes(), 0) << "the largest stage runs";
  EXPECT_GT(PlanOf(SceneSpec(), {.pictures = 60, .layout = CaptureLayout::kColmap})
                .expected_peak_memory_bytes(),
            peak + (int64_t{100} << 20));
}

TEST(JobPlanTest, LeftOutStageSavesMemoryAboveThePeakOnly) {
  const v1::JobPlan film = PlanOf(SceneSpec(), {.pictures = 60, .layout = CaptureLayout::kFilm});
  EXPECT_EQ(StageIn(film, kind::kCorrectColors).expected_peak_memory_bytes(), 0)
      << "it would not raise the peak";
  for (const v1::PlannedStage& stage : film.stages()) {
    if (!stage.runs()) {
      EXPECT_LE(stage.expected_peak_memory_bytes(), film.saved_memory_bytes()) << stage.kind();
    }
  }
}

TEST(JobPlanTest, GrowsWithPhotosPixelsAndIterations) {
  const double seconds = PlanOf(SceneSpec(), kTwentyPhotos).expected_seconds();
  EXPECT_GT(
      PlanOf(SceneSpec(), {.pictures = 40, .layout = CaptureLayout::kColmap}).expected_seconds(),
      seconds + 10.0);
  v1::JobSpec larger = SceneSpec();
  larger.mutable_colorize_scene()->set_max_side_px(1000);
  EXPECT_GT(PlanOf(larger, kTwentyPhotos).expected_seconds(), 2.0 * seconds);
  v1::JobSpec longer = SceneSpec();
  longer.mutable_colorize_scene()->mutable_reconstruct_geometry()->set_iterations(3000);
  EXPECT_GT(PlanOf(longer, kTwentyPhotos).expected_seconds(), seconds + 5.0);
  EXPECT_GT(
      PlanOf(SceneSpec(), {.pictures = 20, .layout = CaptureLayout::kPhotos}).expected_seconds(),
      seconds + 5.0)
      << "poses are estimated";
}

TEST(JobPlanTest, KeepsTimeBudget) {
  v1::JobSpec spec = SpecWithKeyView();
  spec.mutable_colorize_scene()->set_time_budget_seconds(45);
  const double budgeted = PlanOf(spec, kTwentyPhotos).expected_seconds();
  EXPECT_LE(budgeted, 45.0);
  EXPECT_LT(budgeted, PlanOf(SpecWithKeyView(), kTwentyPhotos).expected_seconds());
}

TEST(JobPlanTest, NamesGivenKeyViewAndMissingTruth) {
  const v1::JobPlan plan = PlanOf(SpecWithKeyView(), kTwentyPhotos);
  EXPECT_THAT(StageIn(plan, kind::kSelectKeyView).reason(), HasSubstr("a.jpg"));
  EXPECT_EQ(StageIn(plan, kind::kSelectKeyView).expected_seconds(), 0.0);
  EXPECT_THAT(StageIn(plan, kind::kEvaluate).reason(), HasSubstr("no true colours"));
}

TEST(JobPlanTest, ScalesWithMachine) {
  const double seconds = PlanOf(SceneSpec(), kTwentyPhotos).expected_seconds();
  const v1::JobPlan slow = PlanOf(SceneSpec(), kTwentyPhotos, {.factor = 2.5, .jobs = 9});
  EXPECT_NEAR(slow.expected_seconds(), 2.5 * seconds, 1e-9);
  EXPECT_EQ(slow.measured_jobs(), 9);
}

TEST(MachineFactorTest, IsMedianOfLongJobs) {
  EXPECT_EQ(MeasureMachine({}).factor, 1.0);
  EXPECT_EQ(MeasureMachine({{10, 30}, {10, 30}}).factor, 1.0) << "too few";
  const MachineFactor factor =
      MeasureMachine({{10, 30}, {5, 15}, {20, 60}, {20, 2000}, {0.2, 50}, {10, 30}, {4, 0}});
  EXPECT_NEAR(factor.factor, 3.0, 1e-9) << "neither an outlier nor short jobs count";
  EXPECT_EQ(factor.jobs, 5);
  EXPECT_EQ(MeasureMachine({{1, 1e6}, {1, 1e6}, {1, 1e6}}).factor, 20.0);
}

}  // namespace
}  // namespace color3d
