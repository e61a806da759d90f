// The stages carry_color and render on photos whose cameras are not known.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/color/lab.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/edited_share.h"
#include "core/stage/run_stages.h"
#include "tests/support/scenes/noise_place.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

constexpr int kWide = 176, kHigh = 132;

// Photos of one place, each a step to the right of the one before, and at last one of another
// place, of other shape.
class CarryPicturesTest : public StageTest {
 protected:
  CarryPicturesTest() {
    scene_.are_pictures = true;
    for (int i = 0; i < 3; ++i) Add(NoisePlace(1, kWide, kHigh, 16 * i));
    Add(NoisePlace(2, kHigh, kWide, 0));
    AddInput(artifact::kScene, SceneToJson(scene_));
    AddInput(artifact::kKeyView, R"({"view": "p0.png"})");
    AddInput(artifact::kKeyColor, EncodeAbPng(Image(kWide, kHigh, 2, 30.0f)));
  }
  void Add(const Image& gray) {
    View view;
    view.name = view.image_file = "p" + std::to_string(scene_.views.size()) + ".png";
    view.camera = view.captured_camera = GuessedCamera(gray.width, gray.height);
    WriteFileAtomic(scratch_.path() / view.image_file, EncodePng8(gray));
    scene_.views.push_back(view);
  }
  void Carry() {
    StageContext context = MakeContext();
    RunCarryColor({}, context);
  }
  AbMap Carried(int view) {
    const std::string name = ViewArtifact(artifact::kCarried, scene_.views[view]);
    return DecodeAbPng(ReadFile(scratch_.path() / "out" / name), name);
  }
  Scene scene_;
};

TEST_F(CarryPicturesTest, SameThingsGetTheKeyViewsColors) {
  Carry();
  for (int view = 0; view < 3; ++view) {
    const AbMap map = Carried(view);
    ASSERT_EQ(map.ab.width, kWide);
    EXPECT_GT(map.confidence.At(0, kHigh / 2, kWide / 3), 0.5f) << view;
    EXPECT_NEAR(map.ab.At(0, kHigh / 2, kWide / 3), 30.0f, 0.1f) << view;
  }
  EXPECT_LT(Carried(2).confidence.At(0, kHigh / 2, kWide - 3), 0.5f) << "not in the key view";
  const AbMap other = Carried(3);
  EXPECT_EQ(other.ab.width, kHigh);
  for (const float confidence : other.confidence.data) ASSERT_EQ(confidence, 0.0f);
}

TEST_F(CarryPicturesTest, OtherPhotosGetAutomaticColorsWhereTheKeyViewHasThem) {
  const auto embedded = AutomaticColorizer::Embedded();
  AddInput(artifact::kKeyColorFacts,
           nlohmann::json{{"description", embedded->description()}}.dump());
  Carry();
  const AbMap other = Carried(3);
  const AutomaticColor guess =
      embedded->Colorize(LuminanceFromSrgb(NoisePlace(2, kHigh, kWide, 0)));
  EXPECT_NEAR(other.ab.At(0, 60, 60), guess.ab.At(0, 60, 60), 2.0f);
  EXPECT_GT(other.confidence.At(0, 60, 60), 0.0f);
  EXPECT_NEAR(Carried(1).ab.At(0, kHigh / 2, kWide / 3), 30.0f, 0.1f);
}

TEST_F(CarryPicturesTest, EditIsCarriedWithItsEditedShare) {
  Image edit(kWide, kHigh, 2, 30.0f);
  AddEditedShare(Image(kWide, kHigh, 1, 0.8f), &edit);
  AddInput(artifact::kKeyColor, EncodeCarriedPng({edit, Image(kWide, kHigh, 1, 1.0f)}));
  Carry();
  const std::string name = ViewArtifact(artifact::kCarried, scene_.views[1]);
  const CarriedColor carried = DecodeCarriedPng(ReadFile(scratch_.path() / "out" / name), name);
  ASSERT_EQ(carried.ab.channels, 3);
  EXPECT_NEAR(carried.ab.At(0, kHigh / 2, kWide / 3), 30.0f, 0.1f);
  EXPECT_NEAR(carried.ab.At(2, kHigh / 2, kWide / 3), 0.8f, 0.01f);
  EXPECT_GT(carried.confidence.At(0, kHigh / 2, kWide / 3), 0.5f);
}

TEST_F(CarryPicturesTest, PhotosAreWrittenInColor) {
  for (const View& view : scene_.views) {
    AddInput(ViewArtifact(artifact::kViewsAb, view),
             EncodeAbPng(Image(view.camera.width / 2, view.camera.height / 2, 2, 20.0f)));
  }
  StageContext context = MakeContext();
  RunRender({}, context);
  for (const View& view : scene_.views) {
    const Image photo =
        ReadImage(scratch_.path() / "out" / ViewArtifact(artifact::kColoredPhotos, view));
    EXPECT_EQ(photo.width, view.camera.width);
    EXPECT_EQ(photo.height, view.camera.height);
    EXPECT_EQ(photo.channels, 3);
  }
  EXPECT_FALSE(std::filesystem::exists(scratch_.path() / "out" / artifact::kMovie));
}

}  // namespace
}  // namespace color3d
