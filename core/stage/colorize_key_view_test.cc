#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/key_color_sources.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

TEST_F(StageTest, KeepsCapturedLuminanceAndGivenChroma) {
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

TEST_F(StageTest, TransparentPixelsHaveNoConfidence) {
  AddInput(artifact::kScene, SceneToJson(RampScene(scratch_.path(), 48, 32)));
  AddInput(artifact::kKeyView, R"({"view": "p1.png"})");
  const Image luminance = LuminanceFromSrgb(ReadImage(scratch_.path() / "p1.png"));
  const Image srgb = SrgbFromLab(JoinLab(luminance, Image(48, 32, 2, 8.0f)));
  Image painted(48, 32, 4);
  std::copy(srgb.data.begin(), srgb.data.end(), painted.data.begin());
  for (int y = 0; y < 32; ++y) {
    for (int x = 0; x < 24; ++x) painted.At(3, y, x) = 1.0f;
  }
  WriteFileAtomic(scratch_.path() / "part.png", EncodePng8(painted));
  ColorizeKeyViewOptions options;
  options.file = scratch_.path() / "part.png";
  StageContext context = MakeContext();
  RunColorizeKeyView(options, context);
  const AbMap map = DecodeAbPng(ReadFile(scratch_.path() / "out/key_color.png"), "key_color.png");
  EXPECT_EQ(map.confidence.At(0, 16, 12), 1.0f);
  EXPECT_EQ(map.confidence.At(0, 16, 36), 0.0f);
  const auto facts = nlohmann::json::parse(ReadFile(scratch_.path() / "out/key_color.json"));
  EXPECT_NEAR(facts.at("painted").get<double>(), 0.5, 1e-6);
}

// Returns the picture in sepia, and brighter.
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

TEST_F(StageTest, PassesOnFactsAndWarningsOfBackend) {
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
      << "the luminance of the photo was not restored";
}

TEST_F(StageTest, EverySourceOfKeyColorHasARow) {
  using Source = ColorizeKeyViewOptions::Source;
  for (int i = 0; i <= static_cast<int>(Source::kEdit); ++i) {
    EXPECT_NE(std::string(KeyColorSourceName(static_cast<Source>(i))), "") << i;
  }
}

}  // namespace
}  // namespace color3d
