#include "core/stage/formats/artifacts.h"

#include <gtest/gtest.h>

#include "tests/support/stages/evaluated_scene.h"
#include "tests/support/stages/stage_fixture.h"

namespace color3d {
namespace {

TEST_F(StageTest, ImportFactsRoundTrip) {
  ImportFacts facts;
  facts.layout = "colmap";
  facts.photos_found = 7;
  facts.undistorted = true;
  const ImportFacts back = ImportFactsFromJson(ImportFactsToJson(facts));
  EXPECT_EQ(back.layout, "colmap");
  EXPECT_EQ(back.photos_found, 7);
  EXPECT_TRUE(back.undistorted);
  EXPECT_EQ(back.masked_views, 0);
  facts.masked_views = 3;
  EXPECT_EQ(ImportFactsFromJson(ImportFactsToJson(facts)).masked_views, 3);
  EXPECT_THROW(ImportFactsFromJson("{}"), Error);
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

TEST_F(EvaluatedSceneTest, ConfidenceComesFromTheProvenance) {
  AddProvenance("p1.png", Halves({0.0f, 1.0f, 0.0f}, {0.2f, 0.0f, 0.8f}));
  const StageContext context = MakeContext();
  const Image confidence = ReadViewConfidence(context, scene_.views[1], 48, 32);
  EXPECT_NEAR(confidence.At(0, 5, 5), 1.0f, 1e-6);
  EXPECT_NEAR(confidence.At(0, 5, 40), 0.4f, 2e-3);
}

}  // namespace
}  // namespace color3d
