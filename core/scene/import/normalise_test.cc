#include "core/scene/import/normalise.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/formats/scene_readers.h"
#include "core/scene/import/import.h"
#include "tests/support/quiet_run.h"
#include "tests/support/scenes/scene_writers.h"
#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Maps cameras and points by x -> scale x + offset.
Scene Moved(Scene scene, double scale, const Eigen::Vector3d& offset) {
  for (View& view : scene.views) {
    Pose& pose = view.cam_from_world;
    pose.translation = scale * pose.translation - pose.rotation * offset;
  }
  for (SparsePoint& point : scene.points) point.position = scale * point.position + offset;
  return scene;
}

TEST(NormaliseScene, KeepsOrdinaryScenesBitForBit) {
  for (const double scale : {0.3, 1.0, 200.0}) {  // depths 1.2 to 800
    Scene scene = Moved(ArcScene(5), scale, {0.1, -0.2, 0.3});
    const std::string before = SceneToJson(scene);
    EXPECT_THAT(NormaliseScene(&scene), IsEmpty());
    EXPECT_EQ(SceneToJson(scene), before);
  }
}

TEST(NormaliseScene, RescalesExtremeScenesAndInverts) {
  const Scene original = ArcScene(5);
  for (const double scale : {1e-6, 1e-3, 1e6}) {
    for (const Eigen::Vector3d& offset :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(scale * 1e6, -scale * 2e6, 0)}) {
      const Scene moved = Moved(original, scale, offset);
      Scene scene = moved;
      EXPECT_EQ(NormaliseScene(&scene).size(), offset.isZero() ? 1u : 2u);
      EXPECT_NEAR(TypicalDepth(scene), 10.0, 1e-6);
      EXPECT_NEAR(
          scene.world_from_scene_scale, scale * TypicalDepth(original) / 10.0, 1e-6 * scale);
      for (size_t i = 0; i < scene.points.size(); ++i) {
        const Eigen::Vector3d& there = moved.points[i].position;
        EXPECT_LT((scene.WorldFromScene(scene.points[i].position) - there).norm(), 1e-8 * scale);
        EXPECT_LT(scene.points[i].position.norm(), 100.0);
        for (const View& view : scene.views) {
          const size_t v = static_cast<size_t>(&view - scene.views.data());
          const Eigen::Vector2d pixel =
              view.camera.Project(view.cam_from_world.Apply(scene.points[i].position));
          const Eigen::Vector2d expected = view.camera.Project(
              original.views[v].cam_from_world.Apply(original.points[i].position));
          EXPECT_LT((pixel - expected).norm(), 1e-5);
        }
      }
    }
  }
}

TEST(NormaliseScene, CamerasGiveScaleWithoutPoints) {
  Scene scene = Moved(ArcScene(6), 1e-6, {0, 0, 0});
  scene.points.clear();
  EXPECT_THAT(NormaliseScene(&scene), ElementsAre(HasSubstr("put back on export")));
  EXPECT_NEAR(TypicalDepth(scene), 10.0, 1e-6);
  EXPECT_NEAR(scene.world_from_scene_scale, 4e-7, 1e-8);
}

TEST(NormaliseScene, NamesViewsAndPointsOutOfRange) {
  Scene scene = ArcScene(4);
  scene.points[7].position.x() = 1e14;
  EXPECT_THAT(Refusal([&] { NormaliseScene(&scene); }), HasSubstr("sparse point 7 lies 1e+14"));
  scene = ArcScene(4);
  scene.views[2].cam_from_world.translation.y() = 1e13;
  scene.points.clear();
  scene.points.resize(2);
  scene.points[0].views = scene.points[1].views = {0, 1};
  EXPECT_THAT(Refusal([&] { NormaliseScene(&scene); }), HasSubstr("the camera of"));
  scene = ArcScene(4);
  for (View& view : scene.views) view.cam_from_world.translation.setConstant(1.7e308);
  EXPECT_THAT(Refusal([&] { NormaliseScene(&scene); }), HasSubstr("too large"));
}

TEST(NormaliseScene, RefusesPointsBehindAllCameras) {
  Scene scene = ArcScene(4);
  EXPECT_EQ(ShareBehindCameras(scene), 0.0);
  for (View& view : scene.views) {  // turn every camera round
    const Eigen::Vector3d c = view.cam_from_world.Center();
    view.cam_from_world = LookAt(c, 2.0 * c);
  }
  EXPECT_EQ(ShareBehindCameras(scene), 1.0);
  EXPECT_THAT(Refusal([&] { NormaliseScene(&scene); }),
              HasSubstr("all 50 sparse points lie behind the cameras"));
}

class ImportedScene : public testing::Test {
 protected:
  ImportResult Import() { return ImportScene(folder_.path(), scratch_.path(), {}, run_.control()); }
  // Text model of a scene, with one string of one file replaced.
  void Write(const Scene& scene,
             const std::string& file = "",
             const std::string& from = "",
             const std::string& to = "") {
    WritePhotos(scene, folder_.path());
    WriteColmapText(scene, folder_.path());
    if (file.empty()) return;
    std::string text = ReadFile(folder_.path() / file);
    const size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    WriteFileAtomic(folder_.path() / file, text.replace(at, from.size(), to));
  }
  ScratchFolder folder_;
  ScratchFolder scratch_;
  QuietRun run_;
};

TEST_F(ImportedScene, WritersUseWorldCoordinates) {
  Write(Moved(ArcScene(4), 1e-6, {3.0, 4.0, 5.0}));
  const Scene scene = Import().scene;
  EXPECT_NEAR(TypicalDepth(scene), 10.0, 1e-6);
  EXPECT_EQ(SceneToJson(SceneFromJson(SceneToJson(scene))), SceneToJson(scene));
  const ScratchFolder again;
  WritePhotos(scene, again.path());
  WriteColmapText(scene, again.path());
  WriteTransformsJson(scene, again.path() / "transforms.json");
  const Scene colmap = ReadColmapModel(again.path(), again.path());
  const Scene transforms = ReadTransformsJson({again.path() / "transforms.json"}, again.path());
  const Scene written = ReadColmapModel(folder_.path(), folder_.path());
  for (size_t i = 0; i < written.views.size(); ++i) {
    const Eigen::Vector3d there = written.views[i].cam_from_world.Center();
    EXPECT_LT((colmap.views[i].cam_from_world.Center() - there).norm(), 1e-12);
    EXPECT_LT((transforms.views[i].cam_from_world.Center() - there).norm(), 1e-12);
  }
  EXPECT_LT((colmap.points[3].position - written.points[3].position).norm(), 1e-12);
}

TEST_F(ImportedScene, NamesPlaceOfNonFiniteNumbers) {
  const Scene scene = ArcScene(3);
  const auto said = [&](const char* file, const char* from, const char* to) {
    Write(scene, file, from, to);
    return Refusal([&] { Import(); });
  };
  EXPECT_THAT(said("cameras.txt", "PINHOLE 48 32 50", "PINHOLE 48 32 nan"),
              HasSubstr("cameras.txt: line 2: camera 1 has a parameter that is not finite"));
  const std::string pose = "\n2 ";
  EXPECT_THAT(said("images.txt", pose.c_str(), "\n2 nan "), HasSubstr("images.txt: line"));
  EXPECT_THAT(said("points3D.txt", "\n3 ", "\n3 nan "), HasSubstr("points3D.txt: line"));
  Write(scene);
  std::string images = ReadFile(folder_.path() / "images.txt");
  const size_t line = images.find("0001.png\n") + 9;
  images.replace(line, images.find(' ', line) - line, "nan");
  WriteFileAtomic(folder_.path() / "images.txt", images);
  // Only the fit of the cameras is measured with it.
  EXPECT_EQ(Refusal([&] { Import(); }), "");
}

// Two cameras; the second one's views are "0003.png" and "0004.png".
Scene TwoCameras() {
  Scene scene = ArcScene(4);
  for (int i = 2; i < 4; ++i) {
    scene.views[i].captured_camera.fx = 47.0;
    scene.views[i].camera.fx = 47.0;
  }
  return scene;
}

TEST_F(ImportedScene, NamesWrongIntrinsics) {
  Write(TwoCameras());
  EXPECT_THAT(Import().warnings, IsEmpty());
  Write(TwoCameras(), "cameras.txt", "PINHOLE 48 32 47 51", "PINHOLE 48 32 80 87");
  const ImportResult result = Import();
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_THAT(result.warnings[0],
              HasSubstr("the intrinsics of camera 2 (0003.png, 0004.png) do not fit"));
  EXPECT_THAT(result.warnings[0], HasSubstr("other cameras 0.00 px"));
  // Errors below half a pixel cause no warning.
  Write(TwoCameras(), "cameras.txt", "PINHOLE 48 32 47 51", "PINHOLE 48 32 47.5 51.5");
  EXPECT_THAT(Import().warnings, IsEmpty());
}

TEST_F(ImportedScene, WarnsOfInvertedPoses) {
  Scene scene = ArcScene(4);
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector3d c = scene.views[i].cam_from_world.Center();
    scene.views[i].cam_from_world = LookAt(c, 2.0 * c);
  }
  Write(scene);
  const ImportResult result = Import();
  EXPECT_THAT(result.warnings,
              testing::Contains(HasSubstr("50 % of the observations of sparse points lie behind")));
}

}  // namespace
}  // namespace color3d
