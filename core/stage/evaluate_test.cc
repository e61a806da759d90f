#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/catalogue/metrics.h"
#include "core/stage/run_stages.h"
#include "tests/support/stages/evaluated_scene.h"

namespace color3d {
namespace {

using nlohmann::json;

class EvaluateTest : public EvaluatedSceneTest {
 protected:
  json Evaluated(const EvaluateOptions& options) {
    StageContext context = MakeContext();
    RunEvaluate(options, context);
    return json::parse(ReadFile(scratch_.path() / "out/scores.json"));
  }
};

TEST_F(EvaluateTest, ComparesViewsWithoutTruth) {
  const json scores = Evaluated({});
  EXPECT_TRUE(scores.at("views").empty());
  const json& consistency = scores.at("consistency");
  EXPECT_EQ(consistency.at("colored_views").at("pairs"), 3);  // (0, 1), (1, 2) and (0, 2)
  EXPECT_GT(consistency.at("rendered").at("matches"), 50);
  // The chroma of p2 differs from the others': matches with it must show that, the model's not.
  EXPECT_GT(consistency.at("colored_views").at("me_de00"), 3.0);
  EXPECT_LT(consistency.at("rendered").at("me_de00"), 1.0);
  EXPECT_FALSE(consistency.contains("truth"));
}

TEST_F(EvaluateTest, ScoresTheBoundOfTheReconstruction) {
  EvaluateOptions options;
  options.truth = {TruthOf("p0.png")};
  options.training_truth = {TruthOf("p1.png")};
  options.bound = true;
  EXPECT_THROW(Evaluated(options), Error);  // p2 is missing
  options.training_truth.push_back(TruthOf("p2.png"));
  const json scores = Evaluated(options);
  const json& mean = scores.at("mean");
  EXPECT_NEAR(mean.at("delta_e00_chroma_2d").get<double>(), 0.0, 0.05);
  EXPECT_NEAR(mean.at("colorfulness_ratio_2d").get<double>(), 1.0, 0.01);
  EXPECT_LT(mean.at("delta_e00_chroma_bound"), mean.at("delta_e00_chroma"));
  EXPECT_NEAR(mean.at("colorfulness_ratio_bound").get<double>(), 1.0, 0.2);
  EXPECT_LT(scores.at("consistency").at("truth").at("me_de00"),
            scores.at("consistency").at("colored_views").at("me_de00"));
  EXPECT_FALSE(scores.contains("sources"));
  for (const json& metrics : {mean, scores.at("consistency").at("rendered")}) {
    for (const auto& [key, value] : metrics.items()) {
      EXPECT_NE(FindMetric(key).metric, nullptr)
          << key << " has no row in core/catalogue/metrics.cc";
    }
  }
  options.training_truth.clear();
  EXPECT_THROW(Evaluated(options), Error);
}

TEST_F(EvaluateTest, ComparesViewsOnCommonMatches) {
  EvaluateOptions options;
  EXPECT_FALSE(Evaluated(options).at("consistency").at("rendered").contains("me_common"));
  options.truth = {TruthOf("p0.png")};
  const json held_out = Evaluated(options).at("consistency");
  EXPECT_FALSE(held_out.contains("truth"));
  options.training_truth = {TruthOf("p1.png"), TruthOf("p2.png")};
  const json consistency = Evaluated(options).at("consistency");
  const json& colored = consistency.at("colored_views");
  EXPECT_EQ(held_out.at("colored_views").at("me_de00_common"), colored.at("me_de00_common"));
  // p2 is redder.
  EXPECT_GT(colored.at("me_de00_common"), 3.0);
  EXPECT_LT(consistency.at("truth").at("me_de00_common"), colored.at("me_de00_common"));
  for (const char* pictures : {"rendered", "truth"}) {
    EXPECT_EQ(consistency.at(pictures).at("matches_common"), colored.at("matches_common"));
  }
}

TEST_F(EvaluateTest, HasIntervalsOfTwoViewsAndMore) {
  EvaluateOptions options;
  options.truth = {TruthOf("p0.png")};
  EXPECT_FALSE(Evaluated(options).contains("interval_95"));
  scene_.views[1].held_out = true;
  AddInput(artifact::kScene, SceneToJson(scene_));
  options.truth.push_back(TruthOf("p1.png"));
  const json scores = Evaluated(options);
  const json& intervals = scores.at("interval_95");
  EXPECT_FALSE(intervals.empty());
  // More than 2.5 % of the samples of two views have one of them alone.
  for (const auto& [name, interval] : intervals.items()) {
    const double first = scores.at("views")[0].at(name), second = scores.at("views")[1].at(name);
    EXPECT_NEAR(interval.at(0).get<double>(), std::min(first, second), 1e-9) << name;
    EXPECT_NEAR(interval.at(1).get<double>(), std::max(first, second), 1e-9) << name;
  }
}

TEST_F(EvaluateTest, ComparesCamerasOfOneTimeInDynamicScenes) {
  scene_.views[0].moment = Moment{0.0, 1};  // its camera is held out
  scene_.views[1].moment = Moment{0.0, 0};
  scene_.views[2].moment = Moment{0.5, 0};
  ASSERT_TRUE(scene_.capture().is_dynamic);
  AddInput(artifact::kScene, SceneToJson(scene_));
  EvaluateOptions options;
  options.truth = {TruthOf("p0.png")};
  const json scores = Evaluated(options);
  EXPECT_EQ(scores.at("consistency").at("colored_views").at("pairs"), 1);  // p0 and p1
  EXPECT_LT(scores.at("consistency").at("colored_views").at("me_de00"), 5.0) << "p2 is redder";
  EXPECT_EQ(scores.at("views")[0].at("held_out"), "camera");
  EXPECT_EQ(scores.at("held_out").size(), 1u);
  const json& camera = scores.at("held_out").at("camera");
  EXPECT_EQ(camera.at("views"), 1);
  EXPECT_EQ(camera.at("delta_e00_chroma"), scores.at("mean").at("delta_e00_chroma"));
}

TEST_F(EvaluateTest, ReportsErrorsBySource) {
  AddProvenance("p0.png", Halves({0.0f, 1.0f, 0.0f}, {1.0f, 0.0f, 0.0f}));
  EvaluateOptions options;
  options.truth = {TruthOf("p0.png")};
  const json sources = Evaluated(options).at("sources");
  EXPECT_NEAR(sources.at("share_seen").get<double>(), 0.5, 1e-6);
  EXPECT_NEAR(sources.at("share_guessed").get<double>(), 0.5, 1e-6);
  EXPECT_FALSE(sources.contains("delta_e00_inferred"));
}

TEST_F(EvaluateTest, DoesNotScoreMaskedPixels) {
  EvaluateOptions options;
  options.truth = {TruthOf("p0.png")};
  Image truth = ReadImage(options.truth[0].file);
  Image mask(48, 32, 1, 1.0f);
  for (int y = 0; y < 32; ++y) {
    for (int x = 20; x < 48; ++x) {
      mask.At(0, y, x) = 0.0f;
      truth.At(0, y, x) = 0.9f;
      truth.At(2, y, x) = 0.1f;
    }
  }
  WriteFileAtomic(options.truth[0].file, EncodePng16(truth));
  WriteFileAtomic(scratch_.path() / "m.png", EncodePng8(mask));
  AddProvenance("p0.png", Halves({0.0f, 1.0f, 0.0f}, {1.0f, 0.0f, 0.0f}));
  EXPECT_GT(Evaluated(options).at("mean").at("delta_e00_chroma_2d"), 5.0);
  scene_.views[0].mask_file = "m.png";
  AddInput(artifact::kScene, SceneToJson(scene_));
  const json scores = Evaluated(options);
  EXPECT_LT(scores.at("mean").at("delta_e00_chroma_2d"), 0.2);
  EXPECT_EQ(scores.at("sources").at("share_seen"), 1.0) << "the guessed half is masked out";
}

TEST_F(StageTest, EvaluationRefusesTruthOfTrainingViews) {
  const Scene scene = RampScene(scratch_.path(), 48, 32);
  AddInput(artifact::kScene, SceneToJson(scene));
  GaussianModel model;
  AddInput(artifact::kModel, SerializeGaussians(model));
  StageContext context = MakeContext();
  EvaluateOptions options;
  options.truth = {{"p1.png", scratch_.path() / "p1.png"}};
  EXPECT_THROW(RunEvaluate(options, context), Error);
  options.truth.clear();
  options.training_truth = {{"p0.png", scratch_.path() / "p0.png"}};
  EXPECT_THROW(RunEvaluate(options, context), Error);
}

}  // namespace
}  // namespace color3d
