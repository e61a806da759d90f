#include "tests/bench/scale/planned_scene.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/error.h"
#include "core/catalogue/stages.h"
#include "tests/bench/scale/queue_simulation.h"

namespace color3d {
namespace {

double SecondsOf(const SimulatedScene& scene) {
  double seconds = 0.0;
  for (const SimulatedStage& stage : scene.stages) seconds += stage.seconds;
  return seconds;
}

TEST(PlannedSceneTest, HasTheStagesOfASubmission) {
  const SimulatedScene scene = PlannedScene({.photos = 20});
  ASSERT_GE(scene.stages.size(), 10U);
  EXPECT_EQ(scene.stages.front().kind, kind::kImportScene);
  EXPECT_EQ(scene.stages.back().kind, kind::kColorizeScene);
  EXPECT_EQ(scene.stages.back().inputs.size(), scene.stages.size() - 1);
  EXPECT_EQ(scene.files, 20);
  EXPECT_EQ(scene.bytes, 60'000'000);
  // Fern, which has 20 photos, took 25 s, without a decoder (tests/bench/RESULTS.md).
  EXPECT_NEAR(SecondsOf(scene), 25.0, 7.0);
  for (const SimulatedStage& stage : scene.stages) {
    EXPECT_GT(stage.output_files, 0) << stage.kind;
    EXPECT_GT(stage.output_bytes, 0) << stage.kind;
    EXPECT_EQ(stage.resumes, StageOf(stage.kind).resumes) << stage.kind;
  }
}

TEST(PlannedSceneTest, LargerCapturesTakeLonger) {
  const SimulatedScene small = PlannedScene({.photos = 14}), large = PlannedScene({.photos = 50});
  EXPECT_GT(SecondsOf(large), 1.2 * SecondsOf(small));
  EXPECT_GT(SecondsOf(PlannedScene({.photos = 14, .has_poses = false})), SecondsOf(small) + 1.0);
}

TEST(PlannedSceneTest, OneWorkerTakesItsSeconds) {
  QueueModel model;
  model.kinds = {PlannedScene({.photos = 20})};
  model.scenes = 3;
  model.cache_bytes = int64_t{1} << 40;
  EXPECT_NEAR(SimulateQueue(model).makespan, 3.0 * SecondsOf(model.kinds[0]), 0.01);
}

TEST(PlannedSceneTest, RefusesCapturesWithoutPhotos) {
  EXPECT_THROW(PlannedScene({.photos = 0}), Error);
}

}  // namespace
}  // namespace color3d
