#include "core/stage/stage.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/stage/artifacts.h"
#include "core/stage/key_color_sources.h"
#include "core/stage/stages.h"
#include "tests/support/stage_fixture.h"

namespace color3d {
namespace {

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

// Sepia, and brighter than what it was sent.
class SepiaBackend : public RemoteColorizer {
 public:
  RemoteInfo GetInfo(ProgressObserver&, const CancellationToken&) override {
    return {"sepia 1", {capability::kAutomatic}, 0, true};
  }
  std::string Colorize(const RemoteRequest& request,
                       ProgressObserver&,
                       const CancellationToken&) override {
    Image l = LuminanceFromSrgb(DecodeImage(request.image_png, "sent"));
    for (float& value : l.data) value = 0.8f * value + 15.0f;
    return EncodePng8(SrgbFromLab(JoinLab(l, Image(l.width, l.height, 2, 12.0f))));
  }
};

TEST_F(StageTest, TheBackendsFactsAndWarningsReachTheUser) {
  AddInput(artifact::kScene, SceneToJson(RampScene(scratch_.path(), 48, 32)));
  AddInput(artifact::kKeyView, R"({"view": "p1.png"})");
  remote_ = [](const std::string& name) {
    EXPECT_EQ(name, "sepia");
    return std::make_unique<SepiaBackend>();
  };
  ColorizeKeyViewOptions options;
  options.source = ColorizeKeyViewOptions::Source::kBackend;
  options.name = "sepia";
  StageContext context = MakeContext();
  RunColorizeKeyView(options, context);
  const auto facts = nlohmann::json::parse(ReadFile(scratch_.path() / "out/key_color.json"));
  EXPECT_EQ(facts.at("source"), "backend");
  EXPECT_EQ(facts.at("view"), "p1.png");
  EXPECT_EQ(facts.at("description"), "sepia 1");
  EXPECT_GT(facts.at("mean_luminance_difference").get<double>(), 5.0);
  EXPECT_NE(observer_.text.find("changed the luminance"), std::string::npos) << observer_.text;
  const Image shown = ReadImage(scratch_.path() / "out/key_view_colored.png");
  const Image photo = ReadImage(scratch_.path() / "p1.png");
  EXPECT_NEAR(LuminanceFromSrgb(shown).At(0, 16, 24), LuminanceFromSrgb(photo).At(0, 16, 24), 1.0)
      << "the photo's own luminance was not put back";
}

TEST_F(StageTest, NamesThatAreNotThereAreListedWithTheRemedy) {
  models_ = {{"clip", scratch_.path() / "clip"}};
  const StageContext context = MakeContext();
  EXPECT_EQ(context.Model("clip"), scratch_.path() / "clip");
  try {
    context.LoadEncoder("tiny");
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailedPrecondition);
    EXPECT_NE(std::string(e.what()).find("it has: clip"), std::string::npos) << e.what();
  }
  EXPECT_THROW(context.Remote("none"), Error);
}

TEST_F(StageTest, EverySourceOfKeyColourHasItsPlaceInTheTable) {
  using Source = ColorizeKeyViewOptions::Source;
  for (int i = 0; i <= static_cast<int>(Source::kEdit); ++i) {
    EXPECT_NE(std::string(KeyColorSourceName(static_cast<Source>(i))), "") << i;
  }
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

TEST_F(StageTest, ExportWritesBothFormatsInTheWorldsFrameAndSaysWhatTheyLose) {
  Scene scene = RampScene(scratch_.path(), 48, 32);
  scene.world_from_scene_scale = 0.001;
  scene.world_offset = {1e6, 0.0, 0.0};
  AddInput(artifact::kScene, SceneToJson(scene));
  AddInput(artifact::kModel, SerializeGaussians(SmallModel()));
  StageContext context = MakeContext();
  RunExport({}, context);
  EXPECT_EQ(context.outputs(),
            (std::vector<std::string>{"scene.ply", "scene.splat", "export.json"}));
  EXPECT_NE(observer_.text.find("relative to the offset"), std::string::npos) << observer_.text;
  const std::string ply = ReadFile(scratch_.path() / "out/scene.ply");
  EXPECT_NE(ply.find("comment offset 1e+06 0 0\n"), std::string::npos);
  EXPECT_EQ(ReadFile(scratch_.path() / "out/scene.splat").size(), 9u * 32);
  const auto scores = nlohmann::json::parse(ReadFile(scratch_.path() / "out/export.json"));
  const double before = scores.at("ply").at("unrefined_psnr_db_vs_lab");
  const double after = scores.at("ply").at("psnr_db_vs_lab");
  EXPECT_GT(before, 20.0);
  EXPECT_GE(after, before);
  EXPECT_EQ(scores.at("ply").at("worst_view").get<std::string>().substr(0, 1), "p");
  StageContext again = MakeContext();
  EXPECT_THROW(RunExport({.ply = false, .splat = false}, again), Error);
}

TEST_F(StageTest, PosesWithoutPointsReconstructAndLittleMemoryIsPlannedFor) {
  WriteTransformsJson(RampScene(scratch_.path(), 48, 32), scratch_.path() / "transforms.json");
  StageContext import = MakeContext();
  RunImportScene({}, import);
  EXPECT_TRUE(ImportFactsFromJson(ReadFile(scratch_.path() / "out/import.json")).random_points);
  inputs_[artifact::kScene] = scratch_.path() / "out/scene.json";
  GeometryOptions options;
  options.iterations = 2;
  StageContext plenty = MakeContext();
  RunReconstructGeometry(options, 64, plenty);
  auto plan = nlohmann::json::parse(ReadFile(scratch_.path() / "out/memory_plan.json"));
  EXPECT_EQ(plan.at("note"), "");
  EXPECT_EQ(plan.at("max_gaussians"), 5000);
  observer_.text.clear();
  memory_bytes_ = int64_t{101} << 20;
  StageContext little = MakeContext();
  RunReconstructGeometry(options, 64, little);
  plan = nlohmann::json::parse(ReadFile(scratch_.path() / "out/memory_plan.json"));
  EXPECT_LT(plan.at("max_gaussians"), 5000);
  EXPECT_NE(observer_.text.find("memory: 101 MiB may be used"), std::string::npos);
  EXPECT_LE(ParseGaussians(ReadFile(scratch_.path() / "out/geometry.c3g")).size(),
            plan.at("max_gaussians").get<size_t>());
  memory_bytes_ = 1 << 20;
  StageContext none = MakeContext();
  EXPECT_THROW(RunReconstructGeometry(options, 64, none), Error);
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
