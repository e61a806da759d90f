// Poses from other programs: COLMAP text files, names that differ, LLFF.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "core/scene/formats/colmap_model.h"
#include "core/scene/formats/scene_readers.h"
#include "core/scene/import/import.h"
#include "tests/support/formats/npy_writer.h"
#include "tests/support/quiet_run.h"
#include "tests/support/scenes/scene_writers.h"
#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class PosesOfPhotos : public testing::Test {
 protected:
  PosesOfPhotos() {
    WritePhotos(scene_, folder_.path());
    WriteColmapText(scene_, Model());
  }
  fs::path Model() const { return folder_.path() / "sparse/0"; }
  void Replace(const std::string& file, const std::string& from, const std::string& to) {
    std::string text = ReadFile(folder_.path() / file);
    for (size_t at = text.find(from); at != text.npos; at = text.find(from, at + to.size())) {
      text.replace(at, from.size(), to);
    }
    WriteFileAtomic(folder_.path() / file, text);
  }
  ImportResult Run() { return ImportScene(folder_.path(), scratch_.path(), {}, run_.control()); }
  std::string Said() {
    return Refusal([&] { Run(); });
  }
  const Scene scene_ = ArcScene(4);
  ScratchFolder folder_, scratch_;
  QuietRun run_;
};

TEST_F(PosesOfPhotos, ReadsColmapTextWithByteOrderMark) {
  for (const char* file : {"cameras.txt", "images.txt", "points3D.txt"}) {
    WriteFileAtomic(Model() / file, "\xef\xbb\xbf" + ReadFile(Model() / file));
  }
  std::string times = "\xef\xbb\xbf";
  for (const View& view : scene_.views) times += "1 " + view.name + "\n";
  WriteFileAtomic(folder_.path() / "times.txt", times);
  EXPECT_EQ(Run().scene.views.size(), 4u);
  WriteFileAtomic(Model() / "images.txt", std::string("\xff\xfe# \0", 5));
  EXPECT_EQ(Said(), "images.txt is UTF-16 text; save it as UTF-8");
}

TEST_F(PosesOfPhotos, ReadsColmapImagesWithoutObservations) {
  std::string lines;
  const std::string text = ReadFile(Model() / "images.txt");
  for (size_t at = 0; at < text.size();) {
    const size_t end = text.find('\n', at);
    const std::string line = text.substr(at, end - at);
    if (line.ends_with(".png")) lines += line + "\n# a comment\n";
    at = end + 1;
  }
  WriteFileAtomic(Model() / "images.txt", lines);
  const ColmapModel model = LoadColmapModel(Model());
  ASSERT_EQ(model.images.size(), 4u);
  EXPECT_TRUE(model.images.begin()->second.observations.empty());
  // Names of digits, and a mixture of photos with and without observations.
  WriteFileAtomic(Model() / "images.txt",
                  "1 1 0 0 0 0 0 0 1 0001\n2 1 0 0 0 0 0 0 1 0002\n3.5 4.5 -1 5 6 1\n"
                  "3 1 0 0 0 0 0 0 1 a b.png\n\n4 1 0 0 0 0 0 0 1 0004\n");
  const ColmapModel mixed = LoadColmapModel(Model());
  ASSERT_EQ(mixed.images.size(), 4u);
  EXPECT_EQ(mixed.images.at(1).name, "0001");
  EXPECT_TRUE(mixed.images.at(1).observations.empty());
  EXPECT_EQ(mixed.images.at(2).observations.size(), 2u);
  EXPECT_EQ(mixed.images.at(3).name, "a b.png");
}

TEST_F(PosesOfPhotos, IgnoresUnusedValues) {
  WriteFileAtomic(Model() / "points3D.txt",
                  "1 0.1 0.2 0.3 154.0 132.0 1e2 nan 1 0 2 0.0\n"
                  "2 0.3 0.2 0.1 red green blue inf 1 -1 2 x\n"
                  "3 0 0 0\n");
  WriteFileAtomic(Model() / "images.txt",
                  "1 1 0 0 0 0 0 0 1.0 0001.png\nnan nan 18446744073709551615 1 2 -1\n"
                  "2 1 0 0 0 0 0 0 1 0002.png\ninf 2 1 3 4 18446744073709551615\n");
  const ColmapModel model = LoadColmapModel(Model());
  EXPECT_EQ(model.images.at(1).observations.at(0).point_id, -1);
  EXPECT_EQ(model.images.at(2).observations.at(1).point_id, -1);
  ASSERT_EQ(model.points.size(), 3u);
  EXPECT_EQ(model.points[0].error_px, -1.0);
  EXPECT_EQ(model.points[2].error_px, -1.0);
  EXPECT_NO_THROW(ReadColmapModel(Model(), folder_.path()));
  WriteFileAtomic(Model() / "images.txt", "1 1 0 0 0 0 0 0 1.5 0001.png\n");
  EXPECT_EQ(Refusal([&] { LoadColmapModel(Model()); }),
            "images.txt: line 1: \"1.5\" is not a whole number");
}

TEST_F(PosesOfPhotos, MatchesNamesDespiteCaseAndExtension) {
  for (const char* to : {".PNG", ".JPG", "", ".HEIC"}) {
    Replace("sparse/0/images.txt", "0001.png", std::string("0001") + to);
    const ImportResult result = Run();
    ASSERT_EQ(result.scene.views.size(), 4u) << to;
    EXPECT_EQ(result.scene.views[0].name, "0001.png");
    EXPECT_EQ(result.scene.views[0].image_file, "images/0001.png");
    WriteColmapText(scene_, Model());
  }
  fs::create_directories(folder_.path() / "images/left");
  fs::rename(folder_.path() / "images/0003.png", folder_.path() / "images/left/0003.png");
  Replace("sparse/0/images.txt", "0003.png", "left\\0003.png");
  const ImportResult result = Run();
  ASSERT_EQ(result.scene.views.size(), 4u);
  EXPECT_EQ(result.scene.views[3].name, "left/0003.png");
  // Points follow the photos.
  EXPECT_THAT(result.scene.points.at(0).views, ElementsAre(0, 1, 2, 3));
}

TEST_F(PosesOfPhotos, LeavesOutDeletedPhotosWithNote) {
  fs::remove(folder_.path() / "images/0002.png");
  const ImportResult result = Run();
  EXPECT_EQ(result.scene.views.size(), 3u);
  EXPECT_THAT(
      result.warnings,
      Contains("1 of the 4 photos that the COLMAP model names are not among those given and "
               "were left out: 0002.png"));
  EXPECT_THAT(result.scene.points.at(0).views, ElementsAre(0, 1, 2));
  for (const char* photo : {"images/0001.png", "images/0003.png"}) {
    fs::remove(folder_.path() / photo);
  }
  const std::string said = Said();
  EXPECT_THAT(said, HasSubstr("of which 1 are among those given (missing: 0001.png, 0002.png"));
  EXPECT_THAT(said, Not(HasSubstr(folder_.path().string())));
  EXPECT_THAT(said, Not(HasSubstr(scratch_.path().string())));
}

TEST_F(PosesOfPhotos, MatchesTimesByName) {
  WriteFileAtomic(folder_.path() / "times.txt",
                  "0 images\\0001.PNG\n1 0002\n2 images/0003.jpg\n3 0004.png\n4 gone.png\n");
  const ImportResult result = Run();
  EXPECT_TRUE(result.scene.capture().is_dynamic);
  EXPECT_EQ(result.scene.views[2].time_s(), 2.0);
}

TEST_F(PosesOfPhotos, UsesModelWithMostPhotos) {
  Scene few = scene_;
  few.views.resize(2);
  for (SparsePoint& point : few.points) point.views = {0, 1};
  WriteColmapText(few, Model());
  WriteColmapText(scene_, folder_.path() / "sparse/1");
  ImportResult result = Run();
  EXPECT_EQ(result.scene.views.size(), 4u);
  EXPECT_THAT(result.warnings,
              ElementsAre("there are 2 COLMAP models; the one in sparse/1 is used, since it has "
                          "most photos (sparse/0 has 2 of 4, sparse/1 has 4 of 4)"));
  // An unreadable model does not prevent the use of others.
  WriteFileAtomic(Model() / "images.txt", "1 2 3\n");
  result = Run();
  EXPECT_EQ(result.scene.views.size(), 4u);
  EXPECT_THAT(result.warnings,
              Contains(HasSubstr("the COLMAP model in sparse/0 is not used: images.txt: line 1")));
  fs::remove_all(folder_.path() / "sparse/1");
  EXPECT_THAT(Said(), HasSubstr("images.txt: line 1"));
}

TEST_F(PosesOfPhotos, UsesTransformsIfTheyPlaceMore) {
  Scene few = scene_;
  few.views.resize(2);
  for (SparsePoint& point : few.points) point.views = {0, 1};
  WriteColmapText(few, Model());
  WriteTransformsJson(scene_, folder_.path() / "transforms.json");
  const ImportResult result = Run();
  EXPECT_EQ(result.layout, CaptureLayout::kTransforms);
  EXPECT_EQ(result.scene.views.size(), 4u);
  EXPECT_THAT(result.warnings,
              Contains("transforms.json is used: it has the poses of 4 photos, the COLMAP model in "
                       "sparse/0 of 2"));
}

TEST_F(PosesOfPhotos, FindsModelInAnyUsualPlace) {
  for (const char* place : {"sparse/1", "colmap/sparse/0", "colmap/sparse/1", "mine"}) {
    fs::remove_all(folder_.path() / "sparse");
    fs::remove_all(folder_.path() / "colmap");
    WriteColmapText(scene_, folder_.path() / place);
    EXPECT_EQ(Run().layout, CaptureLayout::kColmap) << place;
  }
}

TEST_F(PosesOfPhotos, MergesFilesOfBlender) {
  fs::remove_all(folder_.path() / "sparse");
  Scene train = scene_, test = scene_;
  train.views.resize(3);
  test.views.erase(test.views.begin(), test.views.begin() + 3);
  WriteTransformsJson(train, folder_.path() / "transforms_train.json");
  WriteTransformsJson(test, folder_.path() / "transforms_test.json");
  const ImportResult result = Run();
  EXPECT_EQ(result.layout, CaptureLayout::kTransforms);
  EXPECT_EQ(result.scene.views.size(), 4u);
  EXPECT_THAT(
      result.warnings,
      Contains("the frames of transforms_train.json and transforms_test.json are taken together"));
}

// Rows as LLFF has them: axes down, right, backwards, position; height, width, focal length.
std::string PosesBounds(const Scene& scene) {
  std::vector<double> values;
  for (const View& view : scene.views) {
    const Eigen::Matrix3d r = view.cam_from_world.rotation.conjugate().toRotationMatrix();
    const Eigen::Vector3d c = view.cam_from_world.Center();
    const Camera& camera = view.captured_camera;
    const double intrinsics[3] = {2.0 * camera.height, 2.0 * camera.width, 2.0 * camera.fx};
    for (int i = 0; i < 3; ++i) {
      values.insert(values.end(), {r(i, 1), r(i, 0), -r(i, 2), c[i], intrinsics[i]});
    }
    values.insert(values.end(), {1.0, 10.0});
  }
  return NpyOf({scene.views.size(), 17}, values);
}

TEST_F(PosesOfPhotos, ReadsPosesBoundsOfPhotos) {
  fs::remove_all(folder_.path() / "sparse");
  WriteFileAtomic(folder_.path() / "poses_bounds.npy", PosesBounds(scene_));
  const ImportResult result = Run();
  EXPECT_EQ(result.layout, CaptureLayout::kPosesBounds);
  EXPECT_FALSE(result.ran_structure_from_motion);
  ASSERT_EQ(result.scene.views.size(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    const View& got = result.scene.views[i];
    EXPECT_EQ(got.name, scene_.views[i].name);
    EXPECT_NEAR(got.captured_camera.fx, scene_.views[i].captured_camera.fx, 1e-9);
    EXPECT_LT((got.cam_from_world.Center() - scene_.views[i].cam_from_world.Center()).norm(), 1e-9);
    EXPECT_LT(got.cam_from_world.rotation.angularDistance(scene_.views[i].cam_from_world.rotation),
              1e-6);
  }
  // The missing photo is unknown.
  fs::remove(folder_.path() / "images/0002.png");
  std::vector<std::string> warnings;
  EXPECT_FALSE(ReadPosesOfPhotos(folder_.path(), &warnings).has_value());
  EXPECT_THAT(warnings,
              ElementsAre(HasSubstr("has the poses of 4 photos and names none, but there "
                                    "are 3")));
}

// No message discloses server paths.
TEST_F(PosesOfPhotos, MessagesHideServerPaths) {
  const auto expect = [&](const std::string& said) {
    EXPECT_NE(said, "");
    EXPECT_THAT(said, Not(HasSubstr(folder_.path().string())));
    EXPECT_THAT(said, Not(HasSubstr(scratch_.path().string())));
  };
  for (const char* file : {"cameras.txt", "images.txt", "points3D.txt"}) {
    const std::string text = ReadFile(Model() / file);
    WriteFileAtomic(Model() / file, "oops\n");
    expect(Said());
    fs::remove(Model() / file);
    if (file[0] != 'c') expect(Said());
    WriteFileAtomic(Model() / file, text);
  }
  fs::remove_all(folder_.path() / "sparse");
  for (const char* json :
       {"", "[]", "{\"frames\": []}", "{\"frames\": [{\"file_path\": \"x\"}]}"}) {
    WriteFileAtomic(folder_.path() / "transforms.json", json);
    expect(Said());
  }
  fs::remove(folder_.path() / "transforms.json");
  fs::remove_all(folder_.path() / "images");
  expect(Said());
  WriteFileAtomic(folder_.path() / "one.png", EncodePng8(GradientPhoto(48, 32, 1)));
  expect(Said());
}

}  // namespace
}  // namespace color3d
