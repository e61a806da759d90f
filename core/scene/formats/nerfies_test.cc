#include "core/scene/formats/nerfies.h"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/scene/import/import.h"
#include "tests/support/formats/npy_writer.h"
#include "tests/support/quiet_run.h"
#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

// A folder as HyperNeRF has it: two cameras that take turns, `count` time steps each.
class Nerfies : public testing::Test {
 protected:
  void Write(const std::string& name, const std::string& bytes) {
    fs::create_directories((folder_.path() / name).parent_path());
    WriteFileAtomic(folder_.path() / name, bytes);
  }
  void WriteCamera(const std::string& name, const View& view, const std::string& more = "") {
    const Eigen::Matrix3d r = view.cam_from_world.rotation.toRotationMatrix();
    const Eigen::Vector3d c = view.cam_from_world.Center();
    Write("camera/" + name + ".json",
          fmt::format("{{\"orientation\":[[{},{},{}],[{},{},{}],[{},{},{}]],"
                      "\"position\":[{},{},{}],\"focal_length\":100,\"principal_point\":[48,30],"
                      "\"skew\":0.0,\"pixel_aspect_ratio\":1.02,"
                      "\"radial_distortion\":[0.01,0.002,0.003],\"tangential_distortion\":[0,0],"
                      "\"image_size\":[96,64]{}}}",
                      r(0, 0),
                      r(0, 1),
                      r(0, 2),
                      r(1, 0),
                      r(1, 1),
                      r(1, 2),
                      r(2, 0),
                      r(2, 1),
                      r(2, 2),
                      c.x(),
                      c.y(),
                      c.z(),
                      more));
  }
  void WriteScene(int count) {
    const Scene scene = ArcScene(2 * count);
    std::string metadata, points;
    for (int i = 0; i < 2 * count; ++i) {
      const std::string name = fmt::format("{:06}", i);
      views_.push_back(scene.views[i]);
      WriteCamera(name, scene.views[i]);
      Write("rgb/2x/" + name + ".png", EncodePng8(GradientPhoto(48, 32, 3)));
      metadata += fmt::format(
          "{}\"{}\":{{\"warp_id\":{},\"time_id\":{},\"appearance_id\":0,\"camera_id\":{}}}",
          i == 0 ? "" : ",",
          name,
          7,
          10 + i / 2,
          i % 2);
    }
    Write("metadata.json", "{" + metadata + "}");
    Write("dataset.json", "{}");
    std::vector<double> values;
    for (const SparsePoint& point : scene.points) {
      for (int k = 0; k < 3; ++k) values.push_back(point.position[k]);
    }
    Write("points.npy", NpyOf({scene.points.size(), 3}, values));
  }
  std::string Said() {
    return Refusal([&] { ReadNerfies(folder_.path()); });
  }
  ScratchFolder folder_, scratch_;
  std::vector<View> views_;
};

TEST_F(Nerfies, ReadsCamerasTimesAndPoints) {
  EXPECT_FALSE(IsNerfiesFolder(folder_.path()));
  WriteScene(6);
  ASSERT_TRUE(IsNerfiesFolder(folder_.path()));
  std::vector<std::string> warnings, cameras;
  const Scene scene = ReadNerfies(folder_.path(), &warnings, &cameras);
  EXPECT_THAT(warnings, testing::IsEmpty());
  EXPECT_EQ(cameras, (std::vector<std::string>{"0", "1"}));
  ASSERT_EQ(scene.views.size(), 12u);
  EXPECT_TRUE(scene.capture().is_dynamic);
  const View& view = scene.views[5];
  EXPECT_EQ(view.name, "000005.png");
  EXPECT_EQ(view.image_file, "rgb/2x/000005.png");
  EXPECT_NEAR(view.moment->time_s, 2.0 / 25.0, 1e-12);
  EXPECT_EQ(view.moment->shot, 1);
  EXPECT_EQ(view.captured_camera.width, 48);
  EXPECT_NEAR(view.captured_camera.fx, 50.0, 1e-9);
  EXPECT_NEAR(view.captured_camera.fy, 51.0, 1e-9);
  EXPECT_NEAR(view.captured_camera.cy, 15.0, 1e-9);
  EXPECT_EQ(view.distortion.k[0], 0.01);
  EXPECT_EQ(view.distortion.k[1], 0.002);
  EXPECT_EQ(view.distortion.k[4], 0.003);
  ASSERT_EQ(scene.points.size(), 50u);
  for (const SparsePoint& point : scene.points) {
    EXPECT_GE(point.views.size(), 2u);
    EXPECT_LT(
        (view.cam_from_world.Apply(point.position) - views_[5].cam_from_world.Apply(point.position))
            .norm(),
        1e-5);
  }
}

TEST_F(Nerfies, ImportsWithoutPoints) {
  WriteScene(9);
  fs::remove(folder_.path() / "points.npy");
  QuietRun run;
  ImportOptions options;
  options.hold_out_every_eighth = true;
  const ImportResult result = ImportScene(folder_.path(), scratch_.path(), options, run.control());
  EXPECT_EQ(result.layout, CaptureLayout::kNerfies);
  EXPECT_TRUE(result.undistorted);
  EXPECT_EQ(result.scene.points.size(), 20000u);
  EXPECT_EQ(result.scene.HeldOutViews(), (std::vector<int>{8, 9}));  // the fifth moment
}

TEST_F(Nerfies, LeavesOutFramesWithoutPicture) {
  WriteScene(3);
  fs::remove(folder_.path() / "rgb/2x/000002.png");
  std::vector<std::string> warnings;
  EXPECT_EQ(ReadNerfies(folder_.path(), &warnings).views.size(), 5u);
  EXPECT_THAT(warnings.at(0), HasSubstr("1 of the 6 frames"));
  EXPECT_THAT(warnings.at(0), HasSubstr("000002"));
  fs::remove_all(folder_.path() / "rgb/2x");
  EXPECT_THAT(Said(), HasSubstr("names 6 frames, of which 0 have a picture"));
}

TEST_F(Nerfies, NamesBrokenFiles) {
  WriteScene(2);
  WriteCamera("000001", views_[1], ",\"skew\":0.5");
  EXPECT_EQ(Said(), "camera/000001.json: skew is not supported");
  WriteCamera("000001", views_[1], ",\"focal_length\":-3");
  EXPECT_THAT(Said(), HasSubstr("camera/000001.json: focal_length is -3"));
  WriteCamera("000001", views_[1], ",\"position\":[1,2]");
  EXPECT_THAT(Said(), HasSubstr("position must be 3 finite numbers"));
  WriteCamera("000001", views_[1], ",\"position\":[1e308,1e308,1e308]");
  EXPECT_THAT(Said(), HasSubstr("camera/000001.json: the camera stands too far away"));
  WriteCamera("000001", views_[1], ",\"orientation\":[[1,0,0],[0,1,0],[0,0,-1]]");
  EXPECT_THAT(Said(), HasSubstr("orientation is not a rotation"));
  Write("camera/000001.json", "{");
  EXPECT_THAT(Said(), HasSubstr("camera/000001.json is not JSON: parse error at line 1"));
  WriteCamera("000001", views_[1]);
  Write("points.npy", NpyOf({2, 2}, {1, 2, 3, 4}));
  EXPECT_EQ(Said(), "points.npy must have three columns");
  fs::remove(folder_.path() / "points.npy");
  Write("metadata.json", "{\"000000\":{\"time_id\":1},\"000001\":{\"camera_id\":1}}");
  EXPECT_THAT(Said(), HasSubstr("metadata.json: 000001 (rgb/2x/000001.png) has no time"));
  Write("metadata.json", "{\"../x\":{\"time_id\":1}}");
  EXPECT_THAT(Said(), HasSubstr("is no name of a frame"));
  fs::remove(folder_.path() / "camera/000001.json");
  Write("metadata.json", "{\"000000\":{\"time_id\":1},\"000001\":{\"time_id\":2}}");
  EXPECT_EQ(Said(), "camera/000001.json is missing");
}

}  // namespace
}  // namespace color3d
