#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/splat/raster/render.h"
#include "core/stage/run_stages.h"
#include "tests/support/stages/evaluated_scene.h"

namespace color3d {
namespace {

// Adds the inputs of solve_chroma.
class ConfidenceTest : public EvaluatedSceneTest {
 protected:
  void SetUp() override {
    EvaluatedSceneTest::SetUp();
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
    RunExport({.formats = {ExportFormat::kPly}, .confidence = true}, context);
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
  EXPECT_GT(right, 0.3) << "the key view has no provenance and counts as seen";
  EXPECT_THAT(ExportedPly(), testing::HasSubstr("property float confidence\nend_header"));
  EXPECT_EQ(observer_.text, "");
}

// The two training views disagree: a is 5 in p1 and 25 in p2.
TEST_F(ConfidenceTest, MaskedPartsDoNotColorTheModel) {
  Image mask(48, 32, 1);
  for (int y = 0; y < 32; ++y) mask.At(0, y, 0) = 1.0f;
  WriteFileAtomic(scratch_.path() / "m.png", EncodePng8(mask));
  const auto redness = [&](int masked) {
    Scene scene = scene_;
    scene.views[masked].mask_file = "m.png";
    AddInput(artifact::kScene, SceneToJson(scene));
    ThreadPool pool(1);
    const View& view = scene_.views[1];
    return RenderView(Solved(), view.camera, view.cam_from_world, pool).lab.At(1, 16, 24);
  };
  EXPECT_NEAR(redness(2), 5.0, 2.0);
  EXPECT_NEAR(redness(1), 25.0, 5.0);
}

TEST_F(ConfidenceTest, NeedsProvenance) {
  EXPECT_TRUE(Solved().confidence.empty());
  EXPECT_THAT(ExportedPly(), testing::Not(testing::HasSubstr("confidence")));
  EXPECT_THAT(observer_.text, testing::HasSubstr("has no confidence"));
  StageContext context = MakeContext();
  EXPECT_THROW(RunExport({.formats = {ExportFormat::kSplat}, .confidence = true}, context), Error);
}

// p0 is held out, p1 is the key view with chroma (5, 5).
class HeldOutChromaTest : public ConfidenceTest {
 protected:
  void Predict(const char* view, float chroma) {
    AddInput(ViewArtifact(artifact::kViewsAb, scene_.views[scene_.FindView(view)], ".png"),
             EncodeAbPng(Image(48, 32, 2, chroma)));
  }
  std::vector<double> Curve() {
    observer_.errors.clear();
    Solved();
    return observer_.errors["heldout_delta_e00"];
  }
};

TEST_F(HeldOutChromaTest, IsErrorOfUnseenView) {
  Predict("p2.png", 5.0f);
  Predict("p0.png", 5.0f);
  const std::vector<double> right = Curve();
  ASSERT_GE(right.size(), 2u) << "the closed form, and rounds";
  EXPECT_LT(right.back(), 1.0);
  Predict("p0.png", 40.0f);
  const std::vector<double> wrong = Curve();
  ASSERT_EQ(wrong.size(), right.size());
  EXPECT_GT(wrong.back(), 10.0);
}

TEST_F(HeldOutChromaTest, ReportsDisagreementOfViewsBeforeSolve) {
  const auto disagreement = [&] {
    observer_.errors.clear();
    Solved();
    EXPECT_EQ(observer_.errors["view_disagreement_ab"].size(), 1u);
    EXPECT_EQ(observer_.errors["view_disagreement_ab"],
              std::vector<double>{observer_.errors["train_l1_ab"].front()});
    return observer_.errors["view_disagreement_ab"].back();
  };
  const double apart = disagreement();  // a is 5 in p1 and 25 in p2
  Predict("p2.png", 5.0f);
  EXPECT_GT(apart, 2.0 + disagreement());
}

TEST_F(HeldOutChromaTest, LeavesTheModelAsItIs) {
  const GaussianModel with = Solved();
  ASSERT_FALSE(observer_.errors["heldout_delta_e00"].empty());
  inputs_.erase(ViewArtifact(artifact::kViewsAb, scene_.views[0], ".png"));
  observer_.errors.clear();
  const GaussianModel without = Solved();
  EXPECT_TRUE(observer_.errors["heldout_delta_e00"].empty()) << "nothing was predicted for p0";
  EXPECT_EQ(SerializeGaussians(with), SerializeGaussians(without));
}

// reconstruct_geometry and solve_chroma by the paper's recipe, in miniature.
class JointSolveTest : public EvaluatedSceneTest {
 protected:
  void SetUp() override {
    EvaluatedSceneTest::SetUp();
    inputs_.erase(artifact::kModel);
    AddInput(artifact::kKeyView, R"({"view": "p1.png"})");
    AddInput(artifact::kKeyColor, EncodeAbPng(Image(48, 32, 2, 5.0f)));
    for (int i = 0; i < 60; ++i) {
      SparsePoint point;
      point.position = {0.2 * (i % 10) - 0.9, 0.2 * (i / 10) - 0.5, 2.0};
      point.views = {1, 2};
      scene_.points.push_back(point);
    }
    AddInput(artifact::kScene, SceneToJson(scene_));
    geometry_.recipe = GeometryOptions::Recipe::kPaper;
    geometry_.iterations = 200;
    geometry_.warm_up = 0.5;
    chroma_.solver = ChromaOptions::Solver::kJoint;
  }
  void Reconstruct() {
    RunForInputs([&](StageContext& context) { RunReconstructGeometry(geometry_, 64, context); });
  }
  GaussianModel Solve() {
    StageContext context = MakeContext();
    RunSolveChroma(chroma_, context);
    return ParseGaussians(ReadFile(scratch_.path() / "out/model.c3g"));
  }
  std::string Facts() { return ReadFile(scratch_.path() / "out/joint_training.json"); }

  GeometryOptions geometry_;
  ChromaOptions chroma_;
};

TEST_F(JointSolveTest, GoesOnWithTrainingOfGeometry) {
  Reconstruct();
  const GaussianModel before = ParseGaussians(ReadFile(scratch_.path() / "out/geometry.c3g"));
  chroma_.chroma_sh_degree = 1;
  AddProvenance("p2.png", Halves({0.0f, 1.0f, 0.0f}, {1.0f, 0.0f, 0.0f}));
  const GaussianModel model = Solve();
  EXPECT_EQ(model.channels, 3);
  EXPECT_EQ(model.chroma_sh_degree, 1);
  EXPECT_EQ(model.size(), before.size());
  EXPECT_NE(model.position, before.position);
  EXPECT_EQ(model.confidence.size(), model.size());
  EXPECT_THAT(Facts(), testing::HasSubstr("\"iterations\": 200"));
  EXPECT_THAT(Facts(), testing::HasSubstr("\"warm_up_iterations\": 100"));
  EXPECT_THAT(Facts(), testing::HasSubstr("\"gaussians\": 60"));
  EXPECT_EQ(observer_.text, "");
}

TEST_F(JointSolveTest, TrainsRgbFromSparsePoints) {
  Reconstruct();
  chroma_.color_space = ColorSpace::kSrgb;
  const GaussianModel model = Solve();
  EXPECT_EQ(model.color_space, ColorSpace::kSrgb);
  EXPECT_EQ(model.chroma_sh_degree, model.sh_degree);
  EXPECT_THAT(Facts(), testing::HasSubstr("\"color_space\": \"rgb\""));
  EXPECT_THAT(Facts(), testing::HasSubstr("\"warm_up_iterations\": 0"));
  ThreadPool pool(1);
  const View& view = scene_.views[1];
  const Image lab = RenderView(model, view.camera, view.cam_from_world, pool).lab;
  EXPECT_NEAR(lab.At(1, 16, 24), 5.0, 12.0);  // between the views' 5 and 25
  EXPECT_GT(lab.At(1, 16, 24), 1.0);
  chroma_.adjustment.saturation = 2.0;
  EXPECT_THROW(Solve(), Error);
}

TEST_F(JointSolveTest, RefusesWithoutWarmUp) {
  geometry_.warm_up = 1.0;
  Reconstruct();
  EXPECT_FALSE(inputs_.contains(artifact::kWarmUp));
  try {
    Solve();
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kFailedPrecondition);
    EXPECT_THAT(error.what(), testing::HasSubstr("warm_up below 1"));
  }
  geometry_.warm_up = 0.5;
  geometry_.recipe = GeometryOptions::Recipe::kColor3d;
  EXPECT_THROW(Reconstruct(), Error);
}

// A splat as the scene: its Gaussians count as the result of the warm-up.
TEST_F(JointSolveTest, StartsFromGivenGeometry) {
  GaussianModel given = SmallModel();
  given.channels = 1;
  given.sh_a.clear();
  given.sh_b.clear();
  AddInput(artifact::kGivenGeometry, SerializeGaussians(given));
  scene_.points.clear();
  AddInput(artifact::kScene, SceneToJson(scene_));
  Reconstruct();
  EXPECT_EQ(ReadFile(scratch_.path() / "out/geometry.c3g"), SerializeGaussians(given));
  EXPECT_EQ(Solve().channels, 3);
  EXPECT_THAT(Facts(), testing::HasSubstr("\"warm_up_iterations\": 100"));
}

}  // namespace
}  // namespace color3d
