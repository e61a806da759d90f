#include <gtest/gtest.h>

#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "tests/support/scenes/noise_place.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

// Three views of a ramp with different carried colours.
class ColorizeViewsTest : public StageTest {
 protected:
  ColorizeViewsTest() : scene_(RampScene(scratch_.path(), kWidth, kHeight)) {
    AddInput(artifact::kScene, SceneToJson(scene_));
    AddInput(artifact::kKeyView, R"({"view": "p1.png"})");
    AddInput(artifact::kKeyColor, EncodeAbPng(Image(kWidth, kHeight, 2, 15.0f)));
    AddInput(artifact::kGeometry, SerializeGaussians(SmallModel()));
    StageContext context = MakeContext();
    RunPersonalize({.iterations = 0}, context);
    AddInput(artifact::kColorizer, ReadFile(scratch_.path() / "out" / artifact::kColorizer));
    AddInput(artifact::kCarryFacts, R"({"key_views": ["p1.png"]})");
    for (size_t i = 0; i < scene_.views.size(); ++i) {
      AddInput(ViewArtifact(artifact::kCarried, scene_.views[i]),
               EncodeAbPng(Image(kWidth, kHeight, 2, 15.0f * static_cast<float>(i))));
    }
  }
  std::vector<std::string> Colored(const GaussianModel& geometry) {
    AddInput(artifact::kGeometry, SerializeGaussians(geometry));
    std::filesystem::remove_all(scratch_.path() / "out");
    StageContext context = MakeContext();
    RunColorizeViews({.max_side_px = kWidth}, context);
    std::vector<std::string> files;
    for (const View& view : scene_.views) {
      files.push_back(ReadFile(scratch_.path() / "out" / ViewArtifact(artifact::kViewsAb, view)));
    }
    return files;
  }
  void MakeFilm() {
    for (size_t i = 0; i < scene_.views.size(); ++i) {
      scene_.views[i].moment = Moment{0.1 * static_cast<double>(i), 0};
    }
    AddInput(artifact::kScene, SceneToJson(scene_));
  }

  static constexpr int kWidth = 96, kHeight = 72;
  Scene scene_;
};

TEST_F(ColorizeViewsTest, ColorsFilmOfStaticSceneLikePhotos) {
  const std::vector<std::string> photos = Colored(SmallModel());
  MakeFilm();
  EXPECT_EQ(Colored(SmallModel()), photos);
  EXPECT_NE(Colored(BallBeforeWall(0.0, 0.2)), photos) << "frames are steadied";
}

// Two placed photos of a place, and two that are not placed: of the same place and of another one.
class UnplacedPhotosTest : public StageTest {
 protected:
  UnplacedPhotosTest() {
    scene_.views = {Add("p0.png", 1, 0), Add("p1.png", 1, 16)};
    scene_.unplaced = {Add("p2.png", 1, 32), Add("p3.png", 2, 0)};
    AddInput(artifact::kScene, SceneToJson(scene_));
    AddInput(artifact::kKeyView, R"({"view": "p0.png"})");
    AddInput(artifact::kKeyColor, EncodeAbPng(Image(kWidth, kHeight, 2, 10.0f)));
    AddInput(artifact::kGeometry, SerializeGaussians(SmallModel()));
    StageContext context = MakeContext();
    RunPersonalize({.iterations = 0}, context);
    AddInput(artifact::kColorizer, ReadFile(scratch_.path() / "out" / artifact::kColorizer));
    AddInput(artifact::kCarryFacts, R"({"key_views": ["p0.png"]})");
    for (const View& view : scene_.views) {
      AddInput(ViewArtifact(artifact::kCarried, view),
               EncodeAbPng(Image(kWidth, kHeight, 2, 40.0f)));
    }
  }
  View Add(const std::string& name, int place, int shift) {
    View view;
    view.name = view.image_file = name;
    view.camera = view.captured_camera = GuessedCamera(kWidth, kHeight);
    WriteFileAtomic(scratch_.path() / name, EncodePng8(NoisePlace(place, kWidth, kHeight, shift)));
    return view;
  }
  std::string Output(const std::string& name) const {
    return ReadFile(scratch_.path() / "out" / name);
  }

  static constexpr int kWidth = 176, kHeight = 132;
  Scene scene_;
};

TEST_F(UnplacedPhotosTest, GetColorsOfThePlacedOnesAndAreWritten) {
  StageContext context = MakeContext();
  RunColorizeViews({.max_side_px = kWidth}, context);
  const auto color = [&](const View& view) {
    const std::string name = ViewArtifact(artifact::kViewsAb, view);
    return DecodeAbPng(Output(name), name).ab.At(0, kHeight / 2, kWidth / 3);
  };
  EXPECT_NEAR(color(scene_.unplaced[0]), 40.0f, 2.0f) << "carried";
  EXPECT_NEAR(color(scene_.unplaced[1]), 10.0f, 5.0f) << "inferred by the colorizer";
  for (const View& view : scene_.unplaced) {
    const std::string name = ViewArtifact(artifact::kViewsAb, view);
    AddInput(name, Output(name));
  }
  AddInput(artifact::kModel, SerializeGaussians(SmallModel()));
  StageContext rendering = MakeContext();
  RunRender({}, rendering);
  for (const View& view : scene_.unplaced) {
    const std::string name = ViewArtifact(artifact::kColoredPhotos, view);
    const Image photo = DecodeImage(Output(name), name);
    EXPECT_EQ(photo.width, kWidth);
    EXPECT_EQ(photo.channels, 3);
  }
}

}  // namespace
}  // namespace color3d
