#include "core/stage/formats/artifact_io.h"

#include <gtest/gtest.h>

#include "core/stage/context/stage_context.h"
#include "tests/support/stages/evaluated_scene.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

TEST_F(StageTest, ImportFactsRoundTrip) {
  ImportFacts facts;
  facts.layout = CaptureLayout::kColmap;
  facts.photos_found = 7;
  facts.undistorted = true;
  const ImportFacts back = ImportFactsFromJson(ImportFactsToJson(facts));
  EXPECT_EQ(back.layout, CaptureLayout::kColmap);
  EXPECT_EQ(back.photos_found, 7);
  EXPECT_TRUE(back.undistorted);
  EXPECT_EQ(back.masked_views, 0);
  facts.masked_views = 3;
  EXPECT_EQ(ImportFactsFromJson(ImportFactsToJson(facts)).masked_views, 3);
  EXPECT_THROW(ImportFactsFromJson("{}"), Error);
}

TEST_F(StageTest, FilmFindingsRoundTrip) {
  ImportFacts facts;
  facts.layout = CaptureLayout::kFilm;
  EXPECT_FALSE(ImportFactsFromJson(ImportFactsToJson(facts)).film.has_value());
  facts.film = {.poses_found = true,
                .frames_placed = 61,
                .background_px = 2.5,
                .path_unevenness = 0.07,
                .motion_energy = 0.125};
  const ImportFacts back = ImportFactsFromJson(ImportFactsToJson(facts));
  ASSERT_TRUE(back.film.has_value());
  EXPECT_TRUE(back.film->poses_found);
  EXPECT_FALSE(back.film->camera_stands_still);
  EXPECT_EQ(back.film->frames_placed, 61);
  EXPECT_EQ(back.film->background_px, 2.5);
  EXPECT_EQ(back.film->path_unevenness, 0.07);
  EXPECT_EQ(back.film->motion_energy, 0.125);
}

TEST_F(StageTest, DynamicSceneWithoutGeometryIsColoredAsFilm) {
  Scene scene = RampScene(scratch_.path(), 32, 24);
  EXPECT_TRUE(ColoredAs(MakeContext(), scene).is_reconstructed) << "photos of a place";
  for (View& view : scene.views) view.moment = Moment{0.1, 0};
  ASSERT_TRUE(scene.capture().is_dynamic);
  EXPECT_FALSE(ColoredAs(MakeContext(), scene).is_reconstructed);
  AddInput(artifact::kGeometry, "");
  EXPECT_TRUE(ColoredAs(MakeContext(), scene).is_reconstructed);
  for (View& view : scene.views) view.cam_from_world = Pose();
  EXPECT_FALSE(ColoredAs(MakeContext(), scene).is_reconstructed)
      << "without poses there is no geometry";
}

TEST(ViewArtifactTest, DropsTheExtensionAndFindsCollisions) {
  Scene scene;
  scene.views.resize(2);
  scene.views[0].name = "left/a.jpg";
  scene.views[1].name = "a.png";
  EXPECT_EQ(ViewArtifact("renders/", scene.views[0], ".png"), "renders/left/a.png");
  CheckStemsAreUnique(scene);
  scene.views[1].name = "left/a.png";
  EXPECT_THROW(CheckStemsAreUnique(scene), Error);
}

TEST_F(EvaluatedSceneTest, ConfidenceIsFromProvenance) {
  AddProvenance("p1.png", Halves({0.0f, 1.0f, 0.0f}, {0.2f, 0.0f, 0.8f}));
  const StageContext context = MakeContext();
  const Image confidence = ReadViewConfidence(context, scene_.views[1], 48, 32);
  EXPECT_NEAR(confidence.At(0, 5, 5), 1.0f, 1e-6);
  EXPECT_NEAR(confidence.At(0, 5, 40), 0.4f, 2e-3);
}

}  // namespace
}  // namespace color3d
