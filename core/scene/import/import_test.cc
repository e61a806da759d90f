#include "core/scene/import/import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/image/probe/probe.h"
#include "tests/support/quiet_run.h"
#include "tests/support/scenes/scene_writers.h"
#include "tests/support/scenes/test_exif.h"
#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Import : public testing::Test {
 protected:
  ImportResult Run() {
    return ImportScene(folder_.path(), scratch_.path(), options_, run_.ReportingTo(progress_));
  }
  std::string Said() {
    return Refusal([&] { Run(); });
  }
  void WritePhoto(const std::string& name, int width = 48, int height = 32) {
    fs::create_directories((folder_.path() / name).parent_path());
    WriteFileAtomic(folder_.path() / name, EncodePng8(GradientPhoto(width, height, 1)));
  }
  ScratchFolder folder_;
  ScratchFolder scratch_;
  ImportOptions options_;
  RecordingObserver progress_;
  QuietRun run_;
};

TEST_F(Import, NamesFaultsOfInput) {
  EXPECT_THAT(Said(),
              HasSubstr("the scene contains no photographs (" + ReadableImageFormats() + ")"));
  WriteFileAtomic(folder_.path() / "readme.txt", "hello");
  EXPECT_THAT(Said(), HasSubstr("contains no photographs"));
  WritePhoto("one.png");
  EXPECT_THAT(Said(), HasSubstr("at least 3 photos from different places are needed"));
  WriteFileAtomic(folder_.path() / "notes.jpg", "Buy milk.");
  EXPECT_EQ(Said(), "notes.jpg is not an image (" + ReadableImageFormats() + ")");
  const std::string png = EncodePng8(GradientPhoto(48, 32, 1));
  WriteFileAtomic(folder_.path() / "notes.jpg", png.substr(0, png.size() / 2));
  EXPECT_THAT(Said(), HasSubstr("notes.jpg is truncated"));
  EXPECT_THROW(ImportScene("/no/such/folder", scratch_.path(), options_, run_.control()), Error);
}

TEST_F(Import, ChecksOptions) {
  options_.sfm_max_features = 10;
  EXPECT_THAT(Said(), HasSubstr("sfm_max_features is 10; it must be 512 to 16384"));
  options_ = {};
  options_.sfm_max_image_side_px = 10000;
  EXPECT_THAT(Said(), HasSubstr("sfm_max_image_side_px"));
  options_ = {};
  options_.sfm_timeout = std::chrono::seconds(0);
  EXPECT_THAT(Said(), HasSubstr("sfm_timeout"));
  options_ = {};
  options_.sfm_neighbors = 1;
  EXPECT_THAT(Said(), HasSubstr("sfm_neighbors is 1; it must be 2 to 100"));
}

TEST_F(Import, PrefersColmapToTransforms) {
  const Scene scene = ArcScene(9);
  WritePhotos(scene, folder_.path());
  WritePhoto("images/extra.png");
  WriteTransformsJson(scene, folder_.path() / "transforms.json");
  EXPECT_EQ(Run().layout, CaptureLayout::kTransforms);
  for (const char* place : {"colmap/sparse/0", "sparse", "sparse/0"}) {
    WriteColmapText(scene, folder_.path() / place);
    const ImportResult result = Run();
    EXPECT_EQ(result.layout, CaptureLayout::kColmap) << place;
    EXPECT_EQ(result.photos_found, 10);
    EXPECT_EQ(result.photos_registered, 9);
    EXPECT_FALSE(result.undistorted);
    EXPECT_EQ(result.scene.points.size(), 50u);
    EXPECT_THAT(result.warnings, testing::Contains(HasSubstr("extra.png")));
  }
}

TEST_F(Import, PhotosWithoutPoseAreUnplaced) {
  const Scene scene = ArcScene(9);
  WritePhotos(scene, folder_.path());
  WriteColmapText(scene, folder_.path() / "sparse");
  WritePhoto("images/extra.png", 60, 40);
  WriteFileAtomic(folder_.path() / "images/torn.png", "no picture");
  const ImportResult result = Run();
  EXPECT_EQ(result.scene.views.size(), 9u);
  ASSERT_EQ(result.scene.unplaced.size(), 1u);
  EXPECT_EQ(result.scene.unplaced[0].name, "extra.png");
  EXPECT_EQ(result.scene.unplaced[0].camera.width, 60);
  EXPECT_THAT(result.warnings,
              testing::IsSupersetOf(
                  {HasSubstr("coloured as pictures"), HasSubstr("They are left out: torn.png")}));
}

TEST_F(Import, HoldsOutEveryEighthView) {
  const Scene scene = ArcScene(17);
  WritePhotos(scene, folder_.path());
  WriteColmapText(scene, folder_.path());
  EXPECT_TRUE(Run().scene.HeldOutViews().empty());
  options_.hold_out_every_eighth = true;
  EXPECT_EQ(Run().scene.HeldOutViews(), std::vector<int>({0, 8, 16}));
}

TEST_F(Import, HoldsOutNoneOfTwoViews) {
  const Scene scene = ArcScene(2);
  WritePhotos(scene, folder_.path());
  WriteColmapText(scene, folder_.path());
  options_.hold_out_every_eighth = true;
  const ImportResult result = Run();
  EXPECT_TRUE(result.scene.HeldOutViews().empty());
  ASSERT_EQ(result.warnings.size(), 1u);
  EXPECT_THAT(result.warnings[0], HasSubstr("no view is held out"));
}

// Three cameras on an arc, each a folder, and `steps` times.
Scene RigScene(int steps, const fs::path& folder) {
  Scene scene = ArcScene(3);
  std::vector<View> cameras = std::move(scene.views);
  scene.views.clear();
  for (int step = 0; step < steps; ++step) {
    for (int c = 0; c < 3; ++c) {
      View view = cameras[c];
      view.name = "cam" + std::to_string(c) + "/" + std::to_string(step + 10) + ".png";
      view.image_file = "images/" + view.name;
      view.moment = Moment{0.1 * step, c};
      scene.views.push_back(std::move(view));
    }
  }
  WritePhotos(scene, folder);
  WriteTransformsJson(scene, folder / "transforms.json");
  return scene;
}

TEST_F(Import, HoldsOutTimeStepsWithAllCameras) {
  RigScene(14, folder_.path());
  options_.hold_out_every_eighth = true;
  const ImportResult result = Run();
  EXPECT_TRUE(result.scene.capture().is_dynamic);
  EXPECT_EQ(result.cameras, (std::vector<std::string>{"cam00", "cam01", "cam02"}));
  ASSERT_EQ(result.scene.views.size(), 42u);
  for (const View& view : result.scene.views) {
    // Not the last step: no step follows it.
    EXPECT_EQ(view.held_out, view.name.ends_with("/14.png") || view.name.ends_with("/22.png"))
        << view.name;
    EXPECT_EQ(view.moment->shot, view.name[3] - '0');
  }
}

TEST_F(Import, HoldsOutOneCamera) {
  RigScene(3, folder_.path());
  options_.hold_out_every_eighth = true;
  options_.hold_out_camera = "cam01";
  const ImportResult result = Run();
  EXPECT_THAT(result.warnings, testing::Contains(HasSubstr("only 3 time steps")));
  for (const View& view : result.scene.views) {
    EXPECT_EQ(view.held_out, view.name.starts_with("cam1/")) << view.name;
  }
  options_.hold_out_camera = "cam09";
  EXPECT_THAT(Said(), HasSubstr("no camera 'cam09'; the scene has cam00, cam01, cam02"));
}

TEST_F(Import, ColmapModelWithTimesIsDynamic) {
  const Scene rig = RigScene(14, folder_.path());
  WriteColmapText(rig, folder_.path() / "sparse/0");
  EXPECT_FALSE(Run().scene.capture().is_dynamic);
  std::string times;
  for (const View& view : rig.views) {
    times += std::to_string(7.0 + view.time_s()) + " " + view.name + "\n";
  }
  WriteFileAtomic(folder_.path() / "times.txt", times);
  options_.hold_out_every_eighth = true;
  options_.hold_out_camera = "cam1";
  const ImportResult result = Run();
  EXPECT_EQ(result.layout, CaptureLayout::kColmap);
  EXPECT_TRUE(result.scene.capture().is_dynamic);
  EXPECT_EQ(result.cameras, (std::vector<std::string>{"cam0", "cam1", "cam2"}));
  EXPECT_TRUE(result.warnings.empty());
  ASSERT_EQ(result.scene.views.size(), 42u);
  for (const View& view : result.scene.views) {
    const auto step = std::lround(10.0 * view.time_s());
    EXPECT_EQ(view.name,
              "cam" + std::to_string(view.moment->shot) + "/" + std::to_string(step + 10) + ".png");
    EXPECT_EQ(view.held_out, step % 8 == 4 || view.moment->shot == 1) << view.name;
  }
}

TEST_F(Import, IgnoresTimesWithoutColmapModel) {
  RigScene(3, folder_.path());
  WriteFileAtomic(folder_.path() / "times.txt", "not read");
  EXPECT_THAT(Run().warnings,
              testing::Contains(HasSubstr("times.txt is not read: it goes with a COLMAP model")));
}

TEST_F(Import, HoldsOutBlockBesideCamerasAndTimes) {
  RigScene(20, folder_.path());
  options_.hold_out_every_eighth = true;
  options_.hold_out_camera = "cam01";
  options_.hold_out_block = 0.2;
  for (const View& view : Run().scene.views) {
    const auto step = std::lround(10.0 * view.time_s());
    EXPECT_EQ(view.held_out,
              view.name.starts_with("cam1/") || step % 8 == 4 || (step >= 8 && step < 12))
        << view.name;
  }
  options_.hold_out_block = 0.6;
  EXPECT_THAT(Said(), HasSubstr("hold_out_block is 0.6; it must be 0 to 0.5"));
  options_.hold_out_block = 0.05;
  EXPECT_THAT(Said(), HasSubstr("less than two of them"));
}

TEST_F(Import, RefusesTimesWithOnePose) {
  Scene scene = ArcScene(3);
  for (View& view : scene.views) {
    view.cam_from_world = scene.views[0].cam_from_world;
    view.moment = Moment{0.1 * static_cast<double>(&view - scene.views.data()), 0};
  }
  WritePhotos(scene, folder_.path());
  WriteTransformsJson(scene, folder_.path() / "transforms.json");
  EXPECT_THAT(Said(), HasSubstr("one static camera"));
}

TEST_F(Import, RecentersGeographicCoordinates) {
  Scene scene = ArcScene(4);
  WritePhotos(scene, folder_.path());
  scene.world_offset = {4.5e5, 5.3e6, 410.0};
  WriteColmapText(scene, folder_.path());
  const ImportResult result = Run();
  EXPECT_GT(result.scene.world_offset.norm(), 1e6);
  for (size_t i = 0; i < scene.points.size(); ++i) {
    const Eigen::Vector3d& p = result.scene.points[i].position;
    EXPECT_LT(p.norm(), 10.0);
    EXPECT_LT(
        (p + result.scene.world_offset - scene.points[i].position - scene.world_offset).norm(),
        1e-6);
    for (size_t v = 0; v < 4; ++v) {
      EXPECT_LT((result.scene.views[v].cam_from_world.Apply(p) -
                 scene.views[v].cam_from_world.Apply(scene.points[i].position))
                    .norm(),
                1e-6);
    }
  }
}

TEST_F(Import, DropsPointsOfOneView) {
  Scene scene = ArcScene(3);
  scene.points[0].views = {1};
  scene.points[1].views = {0, 2};
  WritePhotos(scene, folder_.path());
  WriteColmapText(scene, folder_.path());
  EXPECT_EQ(Run().scene.points.size(), 49u);
}

TEST_F(Import, AddsRandomVisiblePointsToPoses) {
  const Scene scene = ArcScene(8);
  WritePhotos(scene, folder_.path());
  WriteTransformsJson(scene, folder_.path() / "transforms.json");
  const ImportResult result = Run();
  ASSERT_EQ(result.scene.points.size(), 20000u);
  EXPECT_THAT(result.warnings.at(0), HasSubstr("20000 random ones"));
  for (const SparsePoint& point : result.scene.points) {
    ASSERT_GE(point.views.size(), 2u);
    for (int v : point.views) {
      const View& view = result.scene.views[v];
      const Eigen::Vector3d p = view.cam_from_world.Apply(point.position);
      ASSERT_GT(p.z(), 0.0);
      const Eigen::Vector2d pixel = view.camera.Project(p);
      ASSERT_TRUE(pixel.x() >= 0 && pixel.x() < view.camera.width);
    }
  }
  EXPECT_EQ(SceneToJson(Run().scene), SceneToJson(result.scene));  // the same every time
}

}  // namespace
}  // namespace color3d
