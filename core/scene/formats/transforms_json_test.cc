#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/scene/formats/scene_readers.h"
#include "tests/support/scenes/scene_writers.h"
#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

TEST(Transforms, RoundTrip) {
  for (const Distortion& distortion :
       {Distortion{},
        Distortion{Distortion::Model::kBrown, {-0.1, 0.01, 1e-3, 2e-3, 0.01}},
        Distortion{Distortion::Model::kBrown, {-0.1, 0.01, 1e-3, 2e-3, 0.01, 0.02, 0.03, 0.04}},
        Distortion{Distortion::Model::kFisheye, {0.05, -0.01, 0.002, 0.001}}}) {
    const ScratchFolder folder;
    const Scene scene = ArcScene(3, distortion);
    WritePhotos(scene, folder.path());
    WriteTransformsJson(scene, folder.path() / "transforms.json");
    const Scene read = ReadTransformsJson({folder.path() / "transforms.json"}, folder.path());
    ASSERT_EQ(read.views.size(), 3u);
    for (int i = 0; i < 3; ++i) {
      const View& g = read.views[i];
      const View& e = scene.views[i];
      EXPECT_EQ(g.name, e.name);
      EXPECT_EQ(g.image_file, e.image_file);
      EXPECT_EQ(g.distortion.model, e.distortion.model);
      EXPECT_EQ(g.distortion.k, e.distortion.k);
      EXPECT_NEAR(g.captured_camera.fy, e.captured_camera.fy, 1e-9);
      EXPECT_NEAR(g.captured_camera.cx, e.captured_camera.cx, 1e-9);
      for (const SparsePoint& point : scene.points) {
        EXPECT_LT((g.cam_from_world.Apply(point.position) - e.cam_from_world.Apply(point.position))
                      .norm(),
                  1e-9);
      }
    }
  }
}

// The text of a file with identity-like frames a.png, b.png.
std::string Json(const std::string& globals,
                 const std::string& frame_extra = "",
                 const std::string& first_row = "[1,0,0,0.5]") {
  std::string text = "{" + globals + (globals.empty() ? "" : ",") + "\"frames\":[";
  for (const char* name : {"./images/a", "images/b.png"}) {
    text += std::string(name[0] == '.' ? "" : ",") + "{\"file_path\":\"" + name + "\"," +
            frame_extra + (frame_extra.empty() ? "" : ",") + "\"transform_matrix\":[" + first_row +
            ",[0,1,0,0],[0,0,1,4],[0,0,0,1]]}";
  }
  return text + "]}";
}

class TransformsFile : public testing::Test {
 protected:
  TransformsFile() {
    fs::create_directories(folder_.path() / "images");
    for (const char* name : {"images/a.png", "images/b.png"}) {
      WriteFileAtomic(folder_.path() / name, EncodePng8(GradientPhoto(48, 32, 1)));
    }
  }
  Scene Read(const std::string& text) {
    WriteFileAtomic(file(), text);
    return ReadTransformsJson({file()}, folder_.path());
  }
  std::string Said(const std::string& text) {
    return Refusal([&] { Read(text); });
  }
  fs::path file() const { return folder_.path() / "transforms.json"; }
  ScratchFolder folder_;
};

TEST_F(TransformsFile, NerfFieldOfViewAndNamesWithoutExtension) {
  const Scene scene = Read(Json("\"camera_angle_x\":0.9"));
  ASSERT_EQ(scene.views.size(), 2u);
  const View& view = scene.views[0];
  EXPECT_EQ(view.name, "a.png");
  EXPECT_EQ(view.image_file, "images/a.png");
  EXPECT_NEAR(view.camera.fx, 24.0 / std::tan(0.45), 1e-9);
  EXPECT_EQ(view.camera.fy, view.camera.fx);
  EXPECT_EQ(view.camera.cx, 24.0);
  EXPECT_EQ(view.camera.cy, 16.0);
  // OpenGL looks along -z: from z = 4 the origin is 4 in front, y up is y down of ours.
  EXPECT_LT((view.cam_from_world.Apply({0.5, 1.0, 0.0}) - Eigen::Vector3d(0, -1, 4)).norm(), 1e-12);
  EXPECT_LT((view.cam_from_world.Center() - Eigen::Vector3d(0.5, 0, 4)).norm(), 1e-12);
}

TEST_F(TransformsFile, FramesOverrideDefaultsAndSizesScale) {
  const Scene scene = Read(Json("\"fl_x\":1,\"w\":480,\"h\":320,\"k1\":0.5,\"cx\":200",
                                "\"fl_x\":500,\"fl_y\":510,\"k1\":0.01"));
  EXPECT_NEAR(scene.views[1].captured_camera.fx, 50.0, 1e-9);
  EXPECT_NEAR(scene.views[1].captured_camera.fy, 51.0, 1e-9);
  EXPECT_NEAR(scene.views[1].captured_camera.cx, 20.0, 1e-9);
  EXPECT_NEAR(scene.views[1].captured_camera.cy, 16.0, 1e-9);
  EXPECT_EQ(scene.views[1].distortion.k[0], 0.01);
  EXPECT_THAT(Said(Json("\"fl_x\":50,\"w\":480,\"h\":480")), HasSubstr("480 x 480 px"));
}

TEST_F(TransformsFile, FisheyeByEitherName) {
  for (const char* mark : {"\"camera_model\":\"OPENCV_FISHEYE\"", "\"is_fisheye\":true"}) {
    const Scene scene = Read(Json(std::string("\"fl_x\":50,\"k1\":0.1,\"k4\":0.001,") + mark));
    EXPECT_EQ(scene.views[0].distortion.model, Distortion::Model::kFisheye);
    EXPECT_EQ(scene.views[0].distortion.k[3], 0.001);
  }
}

TEST_F(TransformsFile, AcceptsScaledRotations) {
  const Scene scene = Read(Json("\"fl_x\":50", "", "[1.001,0,0,0.5]"));
  EXPECT_NEAR(scene.views[0].cam_from_world.rotation.norm(), 1.0, 1e-12);
}

TEST_F(TransformsFile, LeavesOutMissingPhotosWithWarning) {
  std::string text = Json("\"fl_x\":50");
  text.replace(text.find("\"frames\":[") + 10,
               0,
               "{\"file_path\":\"images/gone.png\",\"transform_matrix\":[]},");
  WriteFileAtomic(file(), text);
  std::vector<std::string> warnings;
  EXPECT_EQ(ReadTransformsJson({file()}, folder_.path(), &warnings).views.size(), 2u);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_THAT(warnings[0], HasSubstr("1 of the 3 photos"));
  EXPECT_THAT(warnings[0], HasSubstr("images/gone.png"));
  fs::remove(folder_.path() / "images/a.png");
  EXPECT_THAT(Said(text), HasSubstr("names 3 photos, of which 1 are among those given"));
  EXPECT_THAT(Said(text), testing::Not(HasSubstr(folder_.path().string())));
}

// Json() with additional fields for each of the two frames.
std::string TimedJson(const std::string& of_a, const std::string& of_b) {
  std::string text = Json("\"fl_x\":50");
  for (const auto& [name, fields] : {std::pair("./images/a", of_a), {"images/b.png", of_b}}) {
    const std::string path = "{\"file_path\":\"" + std::string(name) + "\",";
    text.insert(text.find(path) + path.size(), fields);
  }
  return text;
}

TEST_F(TransformsFile, FramesHaveTimes) {
  EXPECT_FALSE(Read(Json("\"fl_x\":50,\"time\":3")).views[0].moment);  // not in a frame
  Scene scene = Read(TimedJson("\"time\":0.75,", "\"time\":0.25,"));
  EXPECT_EQ(scene.views[0].moment, (Moment{0.5, 0}));
  EXPECT_EQ(scene.views[1].moment, (Moment{0.0, 0}));
  scene = Read(TimedJson("\"time\":0.5,\"time_offset\":0.25,", "\"time\":1,\"time_offset\":-1,"));
  EXPECT_NEAR(scene.views[0].moment->time_s, 0.75, 1e-12);
  EXPECT_EQ(scene.views[1].moment->time_s, 0.0);
  scene = Read(TimedJson("\"time\":2,\"camera\":\"r\",", "\"time\":1,\"camera\":\"l\","));
  EXPECT_EQ(scene.views[0].moment, (Moment{1.0, 1}));
  EXPECT_EQ(scene.views[1].moment, (Moment{0.0, 0}));
  std::vector<std::string> warnings;
  WriteFileAtomic(file(), TimedJson("\"time\":2,", "\"time\":2,"));
  EXPECT_FALSE(ReadTransformsJson({file()}, folder_.path(), &warnings).views[0].moment);
  EXPECT_THAT(warnings.at(0), HasSubstr("the scene is static"));
}

TEST_F(TransformsFile, NamesFrameOfBadTime) {
  EXPECT_THAT(Said(TimedJson("\"time\":0,", "")),
              HasSubstr("frame 1 (images/b.png) has no time, but transforms.json: frame 0"));
  EXPECT_THAT(Said(TimedJson("\"time\":0,", "\"time\":null,")), HasSubstr("has no time"));
  EXPECT_THAT(Said(TimedJson("\"time\":0,", "\"time\":\"1\",")),
              HasSubstr("frame 1: time must be a finite number"));
  EXPECT_THAT(Said(TimedJson("\"time\":0,", "\"time\":NaN,")),
              HasSubstr("frame 1: time must be a finite number"));
  EXPECT_THAT(Said(TimedJson("\"time\":0,\"camera\":3,", "\"time\":1,")),
              HasSubstr("frame 0: camera must be a text"));
}

TEST_F(TransformsFile, ReadsFilesOfOtherPrograms) {
  std::string text = "\xef\xbb\xbf" + Json("\"fl_x\":50,\"aabb_scale\":NaN,\"offset\":[1e999,],");
  text.replace(text.find(",,"), 2, ",");
  EXPECT_EQ(Read(text).views.size(), 2u);
  EXPECT_THAT(Said(Json("\"fl_x\":NaN")), HasSubstr("frame 0: fl_x must be a finite number"));
  EXPECT_THAT(Said(Json("\"fl_x\":50", "", "[1,0,0,NaN]")),
              HasSubstr("frame 0: transform_matrix has an element that is not a finite number"));
}

TEST_F(TransformsFile, MatchesNamesDespiteCaseAndExtension) {
  for (const char* name :
       {"images\\\\b.png", "IMAGES/B.PNG", "b.jpg", "C:\\\\x\\\\images\\\\b", "../images/b"}) {
    std::string text = Json("\"fl_x\":50");
    text.replace(text.find("images/b.png"), 12, name);
    const Scene scene = Read(text);
    ASSERT_EQ(scene.views.size(), 2u) << name;
    EXPECT_EQ(scene.views[1].image_file, "images/b.png");
  }
}

TEST_F(TransformsFile, IgnoresFilesOutsideOfScene) {
  const ScratchFolder other;
  const fs::path secret = other.path() / "secret.png";
  WriteFileAtomic(secret, EncodePng8(GradientPhoto(48, 32, 1)));
  const std::string relative = secret.lexically_relative(folder_.path()).string();
  for (const std::string& name : {secret.string(), relative, "images/../" + relative}) {
    std::string text = Json("\"fl_x\":50");
    text.replace(text.find("images/b.png"), 12, name);
    EXPECT_THAT(Said(text), HasSubstr("of which 1 are among those given")) << name;
  }
}

TEST_F(TransformsFile, NamesPlaceInBrokenFile) {
  EXPECT_THAT(Said("{\"frames\":"), HasSubstr("transforms.json is not JSON"));
  EXPECT_THAT(Said("{}"), HasSubstr("no list of frames"));
  EXPECT_THAT(Said("{\"frames\":[]}"), HasSubstr("at least 2"));
  EXPECT_THAT(Said("{\"frames\":[3]}"), HasSubstr("frame 0 must be an object"));
  EXPECT_THAT(Said("{\"frames\":[{}]}"), HasSubstr("file_path is missing"));
  EXPECT_THAT(Said(Json("")), HasSubstr("frame 0: fl_x or camera_angle_x is missing"));
  EXPECT_THAT(Said(Json("\"fl_x\":-3")), HasSubstr("focal length"));
  EXPECT_THAT(Said(Json("\"fl_x\":\"50\"")), HasSubstr("fl_x must be a finite number"));
  EXPECT_THAT(Said(Json("\"fl_x\":50,\"w\":0")), HasSubstr("w is 0"));
  EXPECT_THAT(Said(Json("\"fl_x\":50,\"k4\":0.1")), HasSubstr("k4 is not supported"));
  EXPECT_THAT(Said(Json("\"fl_x\":50,\"camera_model\":\"EQUIRECTANGULAR\"")),
              HasSubstr("EQUIRECTANGULAR is not supported"));
  EXPECT_THAT(Said(Json("\"fl_x\":50", "", "[1,0,0,null]")), HasSubstr("finite number"));
  EXPECT_THAT(Said(Json("\"fl_x\":50", "", "[1,0,0]")), HasSubstr("4 columns"));
  EXPECT_THAT(Said(Json("\"fl_x\":50", "", "[0,0,0,0]")), HasSubstr("not a rotation"));
  EXPECT_THAT(Said(Json("\"fl_x\":50", "", "[-1,0,0,0]")), HasSubstr("not a rotation"));
  EXPECT_THAT(Said(Json("\"fl_x\":50", "", "[1,0,0,1e308]")), HasSubstr("too far away"));
  std::string twice = Json("\"fl_x\":50");
  twice.replace(twice.find("images/b.png"), 12, "images/a.png");
  EXPECT_THAT(Said(twice), HasSubstr("names the photo a.png twice"));
}

}  // namespace
}  // namespace color3d
