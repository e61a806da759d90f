#include "core/scene/formats/camera_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/base/error.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

const Camera kAbsent{600, 400, 500.0, 520.0, 310.0, 190.0};

std::string Frame(const std::string& first_row = "[1,0,0,5]", const std::string& extra = "") {
  return "{" + extra + "\"transform_matrix\":[" + first_row + ",[0,1,0,0],[0,0,1,4],[0,0,0,1]]}";
}

std::vector<FileCamera> Read(const std::string& text, const Scene& scene = {}) {
  return ReadCameraFile(text, "path.json", scene, kAbsent, 3);
}

std::string Complaint(const std::string& text) {
  try {
    Read(text);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    return e.what();
  }
  return "none";
}

TEST(CameraFileTest, PosesAreInUnitsOfUploadedModel) {
  Scene scene;
  scene.world_from_scene_scale = 10.0;
  scene.world_offset = {1.0, 2.0, 3.0};
  const auto cameras = Read("{\"frames\":[" + Frame() + "]}", scene);
  ASSERT_EQ(cameras.size(), 1u);
  // world (5, 0, 4), looking along -z with y up.
  const Pose& pose = cameras[0].cam_from_world;
  EXPECT_LT((pose.Center() - Eigen::Vector3d(0.4, -0.2, 0.1)).norm(), 1e-12);
  EXPECT_LT(
      (pose.rotation.conjugate() * Eigen::Vector3d::UnitZ() + Eigen::Vector3d::UnitZ()).norm(),
      1e-12);
  EXPECT_EQ(cameras[0].camera.width, 600);
  EXPECT_EQ(cameras[0].camera.fy, 520.0);
}

TEST(CameraFileTest, ReadsIntrinsicsOfFileOrFrame) {
  const auto cameras =
      Read("{\"w\":200,\"h\":100,\"fl_x\":90,\"frames\":[" + Frame() + "," +
           Frame("[1,0,0,6]", "\"fl_x\":70,\"cx\":99,\"file_path\":\"nowhere.png\",") + "]}");
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[0].camera.fy, 90.0);
  EXPECT_EQ(cameras[1].camera.fx, 70.0);
  EXPECT_EQ(cameras[1].camera.cx, 99.0);
  EXPECT_EQ(cameras[1].camera.height, 100);
  // With a size alone the vertical field of view is kept.
  const auto sized = Read("{\"w\":100,\"h\":200,\"frames\":[" + Frame() + "]}");
  EXPECT_EQ(sized[0].camera.width, 100);
  EXPECT_DOUBLE_EQ(sized[0].camera.fy, 260.0);
  EXPECT_DOUBLE_EQ(sized[0].camera.cx, 50.0);
}

TEST(CameraFileTest, ReadsTimesOfFrames) {
  const auto cameras =
      Read("{\"time\":9,\"frames\":[" + Frame() + "," + Frame("[1,0,0,6]", "\"time\":0.5,") + "]}");
  EXPECT_FALSE(cameras[0].time_s) << "times belong to single frames";
  EXPECT_EQ(cameras[1].time_s, 0.5);
  EXPECT_THAT(Complaint("{\"frames\":[" + Frame("[1,0,0,5]", "\"time\":\"now\",") + "]}"),
              HasSubstr("frame 0: time must be a finite number"));
}

TEST(CameraFileTest, NamesFaults) {
  EXPECT_THAT(Complaint("{\"frames\": ["), HasSubstr("path.json is not JSON"));
  EXPECT_THAT(Complaint(""), HasSubstr("not JSON"));
  EXPECT_THAT(Complaint("[]"), HasSubstr("no list of frames"));
  EXPECT_THAT(Complaint("{\"frames\":[]}"), HasSubstr("empty list of frames"));
  EXPECT_THAT(Complaint("{\"frames\":[7]}"), HasSubstr("frame 0 must be an object"));
  EXPECT_THAT(Complaint("{\"frames\":[{}]}"), HasSubstr("transform_matrix"));
  EXPECT_THAT(Complaint("{\"frames\":[" + Frame() + "," + Frame("[null,0,0,5]") + "]}"),
              HasSubstr("frame 1: transform_matrix"));
  EXPECT_THAT(Complaint("{\"frames\":[" + Frame("[1e999,0,0,5]") + "]}"), HasSubstr("path.json"));
  EXPECT_THAT(Complaint("{\"frames\":[" + Frame("[2,0,0,5]") + "]}"), HasSubstr("not a rotation"));
  EXPECT_THAT(Complaint("{\"frames\":[" + Frame("[1,0,0,1e12]") + "]}"),
              HasSubstr("from the scene"));
  EXPECT_THAT(Complaint("{\"frames\":[" + Frame("[1,0,0,1e300]") + "]}"),
              HasSubstr("too far away"));
  EXPECT_THAT(Complaint("{\"h\":0,\"frames\":[" + Frame() + "]}"), HasSubstr("600 x 0 px"));
  EXPECT_THAT(Complaint("{\"w\":\"wide\",\"frames\":[" + Frame() + "]}"),
              HasSubstr("w must be a finite number"));
  EXPECT_THAT(Complaint("{\"fl_x\":-5,\"frames\":[" + Frame() + "]}"), HasSubstr("positive"));
  EXPECT_THAT(
      Complaint("{\"frames\":[" + Frame() + "," + Frame() + "," + Frame() + "," + Frame() + "]}"),
      HasSubstr("4 frames; at most 3"));
}

}  // namespace
}  // namespace color3d
