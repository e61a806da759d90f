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

}  // namespace
}  // namespace color3d
