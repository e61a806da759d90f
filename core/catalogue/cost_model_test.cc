#include "core/catalogue/cost_model.h"

#include <gtest/gtest.h>

#include <string>

#include "core/base/error.h"
#include "core/catalogue/stages.h"

namespace color3d {
namespace {

constexpr StageWork kFern = {
    .views = 20, .megapixels = 0.1875, .iterations = 1500, .gaussians = 40'000};

TEST(CostModelTest, KnowsEveryStage) {
  for (const Stage& stage : StageCatalogue()) {
    EXPECT_GE(EstimateSeconds(stage.kind, kFern), 0.0) << stage.kind;
  }
  EXPECT_THROW(EstimateSeconds("paint_fence", kFern), Error);
}

TEST(CostModelTest, StagesOverAllViewsGrowWithViewsAndPixels) {
  for (const char* stage : {kind::kSelectKeyView,
                            kind::kCarryColor,
                            kind::kColorizeViews,
                            kind::kSolveChroma,
                            kind::kEvaluate}) {
    const double seconds = EstimateSeconds(stage, kFern);
    StageWork more_views = kFern, more_pixels = kFern;
    more_views.views *= 2;
    more_pixels.megapixels *= 2.0;
    EXPECT_GT(seconds, 0.0) << stage;
    EXPECT_NEAR(EstimateSeconds(stage, more_views), 2.0 * seconds, 1e-9) << stage;
    EXPECT_NEAR(EstimateSeconds(stage, more_pixels), 2.0 * seconds, 1e-9) << stage;
  }
}

TEST(CostModelTest, TrainingGrowsWithIterations) {
  for (const char* stage : {kind::kReconstructGeometry, kind::kPersonalize}) {
    StageWork more = kFern;
    more.iterations *= 2;
    EXPECT_GT(EstimateSeconds(stage, more), 1.5 * EstimateSeconds(stage, kFern)) << stage;
  }
  StageWork more_gaussians = kFern;
  more_gaussians.gaussians *= 3;
  EXPECT_GT(EstimateSeconds(kind::kReconstructGeometry, more_gaussians),
            1.2 * EstimateSeconds(kind::kReconstructGeometry, kFern));
}

TEST(CostModelTest, EarlyEndLimitsPersonalization) {
  StageWork best = {.iterations = 1200};
  const double to_the_end = EstimateSeconds(kind::kPersonalize, best);
  best.ends_early = true;
  EXPECT_LT(EstimateSeconds(kind::kPersonalize, best), 0.5 * to_the_end);
}

TEST(CostModelTest, LeftOutWorkTakesNoTime) {
  StageWork work = kFern;
  EXPECT_EQ(EstimateSeconds(kind::kImportScene, work), 0.0) << "poses are given";
  work.estimates_poses = true;
  EXPECT_GT(EstimateSeconds(kind::kImportScene, work), 5.0);
  work.geometry_given = true;
  EXPECT_EQ(EstimateSeconds(kind::kReconstructGeometry, work), 0.0);
  work.key_view_given = true;
  EXPECT_EQ(EstimateSeconds(kind::kSelectKeyView, work), 0.0);
}

TEST(CostModelTest, DynamicScenesTakeLongerThanStaticOnes) {
  StageWork rig = kFern;
  rig.kind = CaptureKind::kDynamic;
  for (const char* stage : {kind::kReconstructGeometry, kind::kSolveChroma, kind::kRender}) {
    EXPECT_GT(EstimateSeconds(stage, rig), EstimateSeconds(stage, kFern)) << stage;
  }
}

}  // namespace
}  // namespace color3d
