#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/color/lab.h"
#include "core/stage/artifacts.h"
#include "core/stage/report_color.h"
#include "core/stage/stages.h"
#include "core/stage/view_scores.h"
#include "tests/support/stage_fixture.h"

namespace color3d {
namespace {

using nlohmann::json;

class EvaluateTest : public StageTest {
 protected:
  // Three views of a grey ramp, a model, and one chroma for all views but p2, which is redder.
  void SetUp() override {
    scene_ = RampScene(scratch_.path(), 48, 32);
    AddInput(artifact::kScene, SceneToJson(scene_));
    GaussianModel model = SmallModel();
    model.opacity_logit.assign(model.size(), 6.0f);
    model.log_scale.assign(3 * model.size(), -0.7f);
    AddInput(artifact::kModel, SerializeGaussians(model));
    for (const View& view : scene_.views) {
      Image ab(48, 32, 2, 5.0f);
      if (view.name == "p2.png") std::fill_n(ab.Plane(0), ab.PlaneSize(), 25.0f);
      AddInput(ViewArtifact(artifact::kViewsAb, view, ".png"), EncodeAbPng(ab));
    }
  }
  // The photo's own L with chroma (5, 5).
  TruthFile TruthOf(const std::string& name) {
    const Image l = LuminanceFromSrgb(ReadImage(scratch_.path() / name));
    const auto file = scratch_.path() / ("true_" + name);
    WriteFileAtomic(file, EncodePng16(SrgbFromLab(JoinLab(l, Image(48, 32, 2, 5.0f)))));
    return {name, file};
  }
  void AddProvenance(const std::string& name, const Image& shares) {
    AddInput(ViewArtifact(artifact::kProvenance, scene_.views[scene_.FindView(name)], ".png"),
             EncodePng8(shares));
  }
  json Evaluated(const EvaluateOptions& options) {
    StageContext context = MakeContext();
    RunEvaluate(options, context);
    return json::parse(ReadFile(scratch_.path() / "out/scores.json"));
  }

  Scene scene_;
};

// Shares (guessed, seen, inferred) in the left and the right half.
Image Halves(const std::array<float, 3>& left, const std::array<float, 3>& right) {
  Image shares(48, 32, 3);
  for (int c = 0; c < 3; ++c) {
    for (int y = 0; y < 32; ++y) {
      for (int x = 0; x < 48; ++x) shares.At(c, y, x) = x < 24 ? left[c] : right[c];
    }
  }
  return shares;
}

TEST_F(EvaluateTest, WithoutTruthTheViewsAreStillCompared) {
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

TEST_F(EvaluateTest, TheTruthOfAllViewsIsTheFloorAndBoundsTheReconstruction) {
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
  options.training_truth.clear();
  EXPECT_THROW(Evaluated(options), Error);
}

TEST_F(EvaluateTest, ErrorsAreToldBySource) {
  AddProvenance("p0.png", Halves({0.0f, 1.0f, 0.0f}, {1.0f, 0.0f, 0.0f}));
  EvaluateOptions options;
  options.truth = {TruthOf("p0.png")};
  const json sources = Evaluated(options).at("sources");
  EXPECT_NEAR(sources.at("share_seen").get<double>(), 0.5, 1e-6);
  EXPECT_NEAR(sources.at("share_guessed").get<double>(), 0.5, 1e-6);
  EXPECT_FALSE(sources.contains("delta_e00_inferred"));
}

TEST(SourceErrors, ConfidenceThatKnowsTheErrorsCorrelatesWithThem) {
  const Image truth(48, 32, 3, 0.5f);
  Image ab(48, 32, 2);
  for (int y = 0; y < 32; ++y) {
    for (int x = 24; x < 48; ++x) ab.At(0, y, x) = 20.0f;
  }
  SourceErrors good, wrong;
  good.Add(truth, ab, Halves({0.0f, 1.0f, 0.0f}, {0.2f, 0.0f, 0.8f}));
  EXPECT_NEAR(good.Result().at("confidence_rank_correlation"), -1.0, 1e-6);
  EXPECT_NEAR(good.Result().at("delta_e00_seen"), 0.0, 0.01);
  EXPECT_GT(good.Result().at("delta_e00_inferred"), 5.0);
  wrong.Add(truth, ab, Halves({1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}));
  EXPECT_NEAR(wrong.Result().at("confidence_rank_correlation"), 1.0, 1e-6);
}

TEST_F(EvaluateTest, TheReportTellsWhereColoursComeFromAndWhatToColourNext) {
  AddProvenance("p1.png", Halves({0.0f, 1.0f, 0.0f}, {0.0f, 1.0f, 0.0f}));
  AddProvenance("p2.png", Halves({1.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 1.0f}));
  AddInput(artifact::kCarryFacts,
           R"({"coverage": 0.61, "key_views": ["p1.png"],
               "next_key_view": {"name": "p0.png", "coverage_now": 0.61, "coverage_with": 0.83}})");
  AddInput(artifact::kScores,
           R"({"mean": {}, "consistency": {"rendered": {"me": 0.02, "me_de00": 1.5, "tc": 0.001,
               "tc_short": 0.001, "tc_long": 0.001}}, "sources": {"share_seen": 0.6,
               "delta_e00_seen": 1.25, "confidence_rank_correlation": -0.5}})");
  const StageContext context = MakeContext();
  const ColorFacts facts(scene_, context);
  std::map<std::string, double> metrics;
  for (const auto& [name, value] : facts.Metrics()) metrics[name] = value;
  EXPECT_NEAR(metrics.at("share_seen"), 0.5, 0.01);
  EXPECT_NEAR(metrics.at("share_inferred"), 0.25, 0.01);
  EXPECT_NEAR(metrics.at("share_guessed"), 0.25, 0.01);
  EXPECT_EQ(metrics.at("coverage"), 0.61);
  EXPECT_EQ(metrics.at("me"), 0.02);
  EXPECT_EQ(metrics.at("tc"), 0.001);
  EXPECT_EQ(metrics.at("confidence_rank_correlation"), -0.5);
  const auto sections = facts.Sections({{"personalize", 1.0, 1, "validation_delta_e00", 9.0},
                                        {"personalize", 4.0, 60, "validation_delta_e00", 2.5},
                                        {"personalize", 4.0, 60, "stopped_early_iteration", 60.0}});
  ASSERT_EQ(sections.size(), 3u);
  EXPECT_THAT(sections[0].notes.back(), testing::HasSubstr("colour p0.png next"));
  EXPECT_THAT(sections[0].notes.back(), testing::HasSubstr("from 61 % to 83 %"));
  ASSERT_EQ(sections[0].tables.size(), 2u);
  EXPECT_EQ(sections[0].tables[0].rows[0][0], "p2.png") << "least certain first";
  EXPECT_EQ(sections[0].rows.size(), 2u);
  EXPECT_EQ(sections[1].tables[0].rows[0][1], "0.0200");
  EXPECT_EQ(sections[2].curves.size(), 3u);
  EXPECT_THAT(sections[2].notes.front(), testing::HasSubstr("from 9.0 after 1 s to 2.5 after 4 s"));
  EXPECT_THAT(sections[2].notes.front(), testing::HasSubstr("ended at iteration 60"));
}

TEST_F(EvaluateTest, OldJobsHaveNoChaptersAndDamagedFactsAreRefused) {
  {
    const StageContext context = MakeContext();
    EXPECT_TRUE(ColorFacts(scene_, context).Sections({}).empty());
    EXPECT_TRUE(ColorFacts(scene_, context).Metrics().empty());
    EXPECT_TRUE(ReadViewConfidence(context, scene_.views[0], 48, 32).Empty());
  }
  AddInput(artifact::kCarryFacts, R"({"next_key_view": {"name": 3}})");
  const StageContext context = MakeContext();
  EXPECT_THROW(ColorFacts(scene_, context), Error);
}

TEST_F(EvaluateTest, ConfidenceComesFromTheProvenance) {
  AddProvenance("p1.png", Halves({0.0f, 1.0f, 0.0f}, {0.2f, 0.0f, 0.8f}));
  const StageContext context = MakeContext();
  const Image confidence = ReadViewConfidence(context, scene_.views[1], 48, 32);
  EXPECT_NEAR(confidence.At(0, 5, 5), 1.0f, 1e-6);
  EXPECT_NEAR(confidence.At(0, 5, 40), 0.4f, 2e-3);
}

// The chroma stage's inputs, on top of the fixture's.
class ConfidenceTest : public EvaluateTest {
 protected:
  void SetUp() override {
    EvaluateTest::SetUp();
    inputs_[artifact::kGeometry] = inputs_.at(artifact::kModel);
    inputs_.erase(artifact::kModel);
    AddInput(artifact::kKeyView, R"({"view": "p1.png"})");
    AddInput(artifact::kKeyColor, EncodeAbPng(Image(48, 32, 2, 5.0f)));
  }
  GaussianModel Solved() {
    StageContext context = MakeContext();
    RunSolveChroma({}, context);
    return ParseGaussians(ReadFile(scratch_.path() / "out/model.c3g"));
  }
  std::string ExportedPly() {
    inputs_[artifact::kModel] = scratch_.path() / "out/model.c3g";
    StageContext context = MakeContext();
    RunExport({.ply = true, .splat = false, .confidence = true}, context);
    return ReadFile(scratch_.path() / "out/scene.ply");
  }
};

TEST_F(ConfidenceTest, ReachesTheModelAndThePly) {
  AddProvenance("p2.png", Halves({0.0f, 1.0f, 0.0f}, {1.0f, 0.0f, 0.0f}));
  const GaussianModel model = Solved();
  ASSERT_EQ(model.confidence.size(), model.size());
  double left = 0.0, right = 0.0;  // columns of SmallModel: x = -0.3, 0, 0.3
  for (size_t i = 0; i < model.size(); ++i) {
    if (i % 3 == 0) left += model.confidence[i] / 3.0;
    if (i % 3 == 2) right += model.confidence[i] / 3.0;
  }
  EXPECT_GT(left, right + 0.1);
  EXPECT_GT(right, 0.3) << "the key view has no provenance of its own: it is seen everywhere";
  EXPECT_THAT(ExportedPly(), testing::HasSubstr("property float confidence\nend_header"));
  EXPECT_EQ(observer_.text, "");
}

TEST_F(ConfidenceTest, JobsWithoutProvenanceHaveNone) {
  EXPECT_TRUE(Solved().confidence.empty());
  EXPECT_THAT(ExportedPly(), testing::Not(testing::HasSubstr("confidence")));
  EXPECT_THAT(observer_.text, testing::HasSubstr("has no confidence"));
  StageContext context = MakeContext();
  EXPECT_THROW(RunExport({.ply = false, .splat = true, .confidence = true}, context), Error);
}

}  // namespace
}  // namespace color3d
