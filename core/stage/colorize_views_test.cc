#include <gtest/gtest.h>

#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
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

}  // namespace
}  // namespace color3d
