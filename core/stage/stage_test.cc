#include "core/stage/stage.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/stage/artifacts.h"
#include "core/stage/stages.h"

namespace color3d {
namespace {

class StageTest : public ::testing::Test {
 protected:
  StageContext MakeContext() {
    std::filesystem::create_directories(scratch_.path() / "out");
    return StageContext({scratch_.path(), inputs_, scratch_.path() / "out", scratch_.path(), 1, 1},
                        none_,
                        silent_,
                        cancel_);
  }
  void AddInput(const std::string& name, const std::string& bytes) {
    const auto path = scratch_.path() / ("in" + std::to_string(inputs_.size()));
    WriteFileAtomic(path, bytes);
    inputs_[name] = path;
  }

  ScratchFolder scratch_;
  std::map<std::string, std::filesystem::path> inputs_;
  NoCheckpoints none_;
  NullObserver silent_;
  CancellationToken cancel_;
};

// Three photos of a ramp, with made-up poses, as an imported scene.
Scene RampScene(const std::filesystem::path& folder, int width, int height) {
  Scene scene;
  for (int i = 0; i < 3; ++i) {
    Image gray(width, height, 1);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        gray.At(0, y, x) = static_cast<float>(x + y + i) / (width + height + 3);
      }
    }
    View view;
    view.name = "p" + std::to_string(i) + ".png";
    view.image_file = view.name;
    view.camera = {width, height, 50.0, 50.0, width / 2.0, height / 2.0};
    view.captured_camera = view.camera;
    view.cam_from_world.translation = {0.1 * i, 0.0, 0.0};
    view.held_out = i == 0;
    WriteFileAtomic(folder / view.image_file, EncodePng8(gray));
    scene.views.push_back(view);
  }
  return scene;
}

TEST_F(StageTest, AMissingInputNamesTheStageThatMakesIt) {
  const StageContext context = MakeContext();
  try {
    context.Input("colorizer.c3c");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailedPrecondition);
    EXPECT_NE(std::string(e.what()).find("personalize"), std::string::npos) << e.what();
  }
}

TEST_F(StageTest, OutputsStayInsideTheirFolder) {
  StageContext context = MakeContext();
  EXPECT_THROW(context.WriteOutput("../escape", "x"), Error);
  context.WriteOutput("views/a.png", "x");
  EXPECT_EQ(context.outputs(), std::vector<std::string>{"views/a.png"});
  EXPECT_EQ(ReadFile(scratch_.path() / "out/views/a.png"), "x");
}

TEST_F(StageTest, ImportFactsRoundTrip) {
  ImportFacts facts;
  facts.layout = "colmap";
  facts.photos_found = 7;
  facts.undistorted = true;
  const ImportFacts back = ImportFactsFromJson(ImportFactsToJson(facts));
  EXPECT_EQ(back.layout, "colmap");
  EXPECT_EQ(back.photos_found, 7);
  EXPECT_TRUE(back.undistorted);
  EXPECT_THROW(ImportFactsFromJson("{}"), Error);
}

TEST_F(StageTest, AManualKeyViewMayNotBeHeldOut) {
  const Scene scene = RampScene(scratch_.path(), 48, 32);
  AddInput(artifact::kScene, SceneToJson(scene));
  StageContext context = MakeContext();
  SelectKeyViewOptions options;
  options.selection.strategy = KeyViewStrategy::kManual;
  options.view = "p0.png";
  EXPECT_THROW(RunSelectKeyView(options, context), Error);
  options.view = "nowhere.png";
  EXPECT_THROW(RunSelectKeyView(options, context), Error);
  options.view = "p2";
  RunSelectKeyView(options, context);
  const auto key = nlohmann::json::parse(ReadFile(scratch_.path() / "out/key_view.json"));
  EXPECT_EQ(key.at("view"), "p2.png");
}

TEST_F(StageTest, KeyColourKeepsTheCapturedLuminanceAndTheGivenChroma) {
  const Scene scene = RampScene(scratch_.path(), 48, 32);
  AddInput(artifact::kScene, SceneToJson(scene));
  AddInput(artifact::kKeyView, R"({"view": "p1.png"})");
  Image lab(48, 32, 3);
  const Image gray = ReadImage(scratch_.path() / "p1.png");
  const Image luminance = LuminanceFromSrgb(gray);
  std::copy(luminance.data.begin(), luminance.data.end(), lab.data.begin());
  for (int i = 0; i < 48 * 32; ++i) {
    lab.Plane(1)[i] = 8.0f;
    lab.Plane(2)[i] = -6.0f;
  }
  WriteFileAtomic(scratch_.path() / "coloured.png", EncodePng16(SrgbFromLab(lab)));
  ColorizeKeyViewOptions options;
  options.file = scratch_.path() / "coloured.png";
  StageContext context = MakeContext();
  RunColorizeKeyView(options, context);
  const AbMap map = DecodeAbPng(ReadFile(scratch_.path() / "out/key_color.png"), "key_color.png");
  ASSERT_EQ(map.ab.width, 48);
  // The middle of the ramp is far from black and white, so nothing was clipped by the gamut.
  EXPECT_NEAR(map.ab.At(0, 16, 24), 8.0f, 0.1f);
  EXPECT_NEAR(map.ab.At(1, 16, 24), -6.0f, 0.1f);
}

TEST_F(StageTest, EvaluationRefusesTruthOfTrainingViews) {
  const Scene scene = RampScene(scratch_.path(), 48, 32);
  AddInput(artifact::kScene, SceneToJson(scene));
  GaussianModel model;
  AddInput(artifact::kModel, SerializeGaussians(model));
  StageContext context = MakeContext();
  EXPECT_THROW(RunEvaluate({{"p1.png", scratch_.path() / "p1.png"}}, context), Error);
  EXPECT_THROW(RunEvaluate({}, context), Error);
}

TEST(ViewArtifact, DropsThePhotosExtensionAndNoticesCollisions) {
  Scene scene;
  scene.views.resize(2);
  scene.views[0].name = "left/a.jpg";
  scene.views[1].name = "a.png";
  EXPECT_EQ(ViewArtifact("renders/", scene.views[0], ".png"), "renders/left/a.png");
  CheckStemsAreUnique(scene);
  scene.views[1].name = "left/a.png";
  EXPECT_THROW(CheckStemsAreUnique(scene), Error);
}

TEST(RenderOptions, RangesAreChecked) {
  RenderOptions options;
  options.Validate();
  options.max_views = 0;
  EXPECT_THROW(options.Validate(), Error);
  options.max_views = 1;
  options.max_side_px = 1'000'000;
  EXPECT_THROW(options.Validate(), Error);
}

}  // namespace
}  // namespace color3d
