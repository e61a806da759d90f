// Steadiness of a film's colours, as evaluate scores it.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/catalogue/metrics.h"
#include "core/color/lab.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

using nlohmann::json;

constexpr int kWidth = 96, kHeight = 64, kFrames = 6;

class TemporalScoresTest : public StageTest {
 protected:
  // A grey film of two shots; the second one has one frame.
  TemporalScoresTest() {
    for (int i = 0; i < kFrames; ++i) {
      Image gray(kWidth, kHeight, 1);
      for (int y = 0; y < kHeight; ++y) {
        for (int x = 0; x < kWidth; ++x) {
          gray.At(0, y, x) = static_cast<float>(0.5 + 0.2 * std::sin(0.3 * (x + i)) +
                                                0.2 * std::sin(0.2 * y + 0.13 * (x + i)));
        }
      }
      View view;
      view.name = view.image_file = "f" + std::to_string(i) + ".png";
      view.camera =
          view.captured_camera = {kWidth, kHeight, 100.0, 100.0, kWidth / 2.0, kHeight / 2.0};
      view.held_out = i == 0;
      // Names are not in order of time.
      view.moment = Moment{0.1 * (i < 2 ? 1 - i : i), i == kFrames - 1 ? 1 : 0};
      WriteFileAtomic(scratch_.path() / view.image_file, EncodePng8(gray));
      scene_.views.push_back(view);
      const float flicker = i % 2 == 0 ? 10.0f : 14.0f;
      AddInput(ViewArtifact(artifact::kViewsAb, view),
               EncodeAbPng(Image(kWidth, kHeight, 2, flicker)));
      truth_.push_back({view.name, scratch_.path() / ("true_" + view.name)});
      WriteFileAtomic(truth_.back().file,
                      EncodePng16(SrgbFromLab(
                          JoinLab(LuminanceFromSrgb(gray), Image(kWidth, kHeight, 2, 8.0f)))));
    }
    AddInput(artifact::kScene, SceneToJson(scene_));
  }
  json Evaluated(const EvaluateOptions& options) {
    StageContext context = MakeContext();
    RunEvaluate(options, context);
    return json::parse(ReadFile(scratch_.path() / "out/scores.json"));
  }

  Scene scene_;
  std::vector<TruthFile> truth_;
};

TEST_F(TemporalScoresTest, ComparesFramesInOrderWithinShots) {
  const json temporal = Evaluated({}).at("temporal");
  EXPECT_FALSE(temporal.contains("truth"));
  EXPECT_FALSE(temporal.contains("rendered"));
  const json& frames = temporal.at("colored_views");
  for (const auto& [key, value] : frames.items()) {
    EXPECT_NE(FindMetric(key).metric, nullptr) << key << " has no row in core/catalogue/metrics.cc";
  }
  EXPECT_EQ(frames.at("pairs"), 4);
  EXPECT_GT(frames.at("followed"), 0.5);
  // In time: 14, 10, 10, 14, 10; so three of four pairs differ by 4 in a and in b. 8 bits of ab.
  EXPECT_NEAR(frames.at("tc_chroma"), 0.75 * std::hypot(4.0, 4.0), 0.5);
  const double unlike = frames.at("cdc_4");
  EXPECT_GT(unlike, 0.01);
  EXPECT_NEAR(frames.at("cdc_1"), 0.75 * unlike, 0.01 * unlike);
  EXPECT_NEAR(frames.at("cdc_2"), 2.0 / 3.0 * unlike, 0.01 * unlike);
}

TEST_F(TemporalScoresTest, ScoresTruthOfAllFrames) {
  EvaluateOptions options;
  options.truth = {truth_[0]};
  EXPECT_FALSE(Evaluated(options).at("temporal").contains("truth"));
  options.training_truth = {truth_.begin() + 1, truth_.end()};
  const json truth = Evaluated(options).at("temporal").at("truth");
  EXPECT_NEAR(truth.at("tc_chroma"), 0.0, 0.1);
  EXPECT_NEAR(truth.at("chroma"), std::hypot(8.0, 8.0), 0.5);
}

TEST_F(TemporalScoresTest, ScoresRendersOfModelAndBound) {
  GaussianModel model = SmallModel();
  model.opacity_logit.assign(model.size(), 6.0f);
  model.log_scale.assign(3 * model.size(), 1.0f);
  AddInput(artifact::kModel, SerializeGaussians(model));
  for (size_t i = 0; i < scene_.views.size(); ++i) {
    scene_.views[i].cam_from_world.translation = {0.001 * static_cast<double>(i), 0.0, 0.0};
  }
  AddInput(artifact::kScene, SceneToJson(scene_));
  EvaluateOptions options;
  options.truth = {truth_[0]};
  options.training_truth = {truth_.begin() + 1, truth_.end()};
  EXPECT_FALSE(Evaluated(options).at("temporal").contains("bound"));
  options.bound = true;
  const json temporal = Evaluated(options).at("temporal");
  EXPECT_GT(temporal.at("rendered").at("pairs"), 0);
  EXPECT_NE(temporal.at("bound").at("chroma"), temporal.at("rendered").at("chroma"));
  EXPECT_NEAR(temporal.at("bound").at("chroma"), std::hypot(8.0, 8.0), 3.0);
}

TEST_F(TemporalScoresTest, GivesNothingForPhotos) {
  for (View& view : scene_.views) view.moment.reset();
  const GaussianModel model = SmallModel();
  AddInput(artifact::kModel, SerializeGaussians(model));
  AddInput(artifact::kScene, SceneToJson(scene_));
  EXPECT_FALSE(Evaluated({}).contains("temporal"));
}

}  // namespace
}  // namespace color3d
