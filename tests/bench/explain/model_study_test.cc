#include "tests/bench/explain/model_study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <torch/types.h>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/color/lab.h"
#include "tests/support/networks/small_colorizer.h"

namespace color3d {
namespace {

class ModelStudyTest : public SmallColorizerTest {
 protected:
  ModelStudyTest() {
    options_.iterations = 100;
    options_.crop_px = 64;
    options_.precision = ColorizerOptions::Precision::kFloat32;
    sizes_ = {.draws = 4, .points = 8, .jacobians = 2, .iterations = 4, .patch_px = 32};
    // Two equal views of the key view's textures.
    const TrainingPicture& key = pictures_[0];
    for (int i = 0; i < 2; ++i) {
      ExplainView& view = scene_.views.emplace_back();
      view.name = i == 0 ? "key" : "other";
      view.lab = JoinLab(key.luminance, key.ab);
      view.luminance = key.luminance;
      view.held_out = i == 1;
    }
    ExplainPair& pair = scene_.pairs.emplace_back();
    pair.second = 1;
    pair.warped = key.luminance;
    for (int y = 2; y < 64; y += 4) {
      for (int x = 2; x < 96; x += 4) pair.matches.push_back({x, y, x + 0.5f, y + 0.5f});
    }
  }

  ColorizerOptions options_;
  StudySizes sizes_;
  ExplainScene scene_;
};

TEST_F(ModelStudyTest, EqualViewsDoNotDiffer) {
  const ModelStudies studies(scene_, encoder_, sizes_);
  const auto model = StartModel(encoder_, pictures_[0], options_);
  const ModelStudy study = studies.Measure("start", 0.0, *model);
  ASSERT_EQ(study.taps.size(), 2u);
  for (const FeatureDistance& tap : study.taps) {
    EXPECT_NEAR(tap.matched, 0.0, 1e-4);
    EXPECT_GT(tap.unmatched, 1e-2);
  }
  EXPECT_NEAR(study.color.matched, 0.0, 1e-4);
  EXPECT_EQ(study.bound.points, 8);
  EXPECT_NEAR(study.bound.color, 0.0, 1e-4);
  EXPECT_NEAR(study.bound.equivariance, 0.0, 1e-4);
}

TEST_F(ModelStudyTest, TrainingReducesErrorAndSeparatesColors) {
  const ModelStudies studies(scene_, encoder_, sizes_);
  const auto start = StartModel(encoder_, pictures_[0], options_);
  const ModelStudy before = studies.Measure("start", 0.0, *start);
  TrainModel(pictures_[0], options_, start.get());
  const ModelStudy after = studies.Measure("trained", 0.0, *start);
  EXPECT_LT(after.delta_e00, 0.8 * before.delta_e00);
  EXPECT_LT(after.delta_e00, studies.GrayError());
  EXPECT_GT(after.color.unmatched, before.color.unmatched);
  EXPECT_GT(after.key_spread.variance, 0.0);
}

TEST_F(ModelStudyTest, MatchesOfOtherSurfacesDiffer) {
  // A wrong match: the left texture with the right one.
  for (PixelMatch& match : scene_.pairs[0].matches) match.u = 96.0f - match.u;
  const ModelStudies studies(scene_, encoder_, sizes_);
  const auto model = StartModel(encoder_, pictures_[0], options_);
  TrainModel(pictures_[0], options_, model.get());
  const ModelStudy study = studies.Measure("trained", 0.0, *model);
  EXPECT_GT(study.color.matched, 5.0);
  EXPECT_GT(study.bound.color, 1.0);
}

TEST_F(ModelStudyTest, MapsHaveSizeOfTheirCells) {
  const ModelStudies studies(scene_, encoder_, sizes_);
  const auto model = StartModel(encoder_, pictures_[0], options_);
  const ViewMaps maps = studies.Maps(1, *model);
  EXPECT_EQ(maps.tap.width, 24);  // stride 4
  EXPECT_EQ(maps.tap.height, 16);
  EXPECT_EQ(maps.decoder.width, 48);
  EXPECT_EQ(maps.colored.width, 96);
  EXPECT_EQ(maps.colored.channels, 3);
}

TEST_F(ModelStudyTest, RefusesPatchesLargerThanPictures) {
  sizes_.patch_px = 96;
  EXPECT_THROW(ModelStudies(scene_, encoder_, sizes_), Error);
}

TEST(ReadExplainSceneTest, NamesWhatRunLacks) {
  const ScratchFolder folder;
  ThreadPool pool(1);
  try {
    ReadExplainScene(folder.path(), folder.path(), 400, 8, pool);
    FAIL() << "an empty folder was read";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("has no scene.json"));
    EXPECT_THAT(error.what(), testing::HasSubstr("color3d-bench pipeline"));
  }
}

}  // namespace
}  // namespace color3d
