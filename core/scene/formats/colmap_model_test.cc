#include "core/scene/formats/colmap_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>

#include "core/scene/formats/scene_readers.h"
#include "core/scene/photos.h"
#include "tests/support/scenes/scene_writers.h"
#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

template <typename T>
void Put(std::string* bytes, T value) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof(T));
}

// COLMAP's binary files, written from a scene as documented, with the PINHOLE or OPENCV model.
struct BinaryModel {
  std::string cameras, images, points;
  void Write(const fs::path& folder) const {
    fs::create_directories(folder);
    // Without fsync, since some tests write hundreds of them.
    std::ofstream(folder / "cameras.bin", std::ios::binary) << cameras;
    std::ofstream(folder / "images.bin", std::ios::binary) << images;
    std::ofstream(folder / "points3D.bin", std::ios::binary) << points;
  }
};

BinaryModel MakeBinary(const Scene& scene) {
  BinaryModel out;
  const View& first = scene.views.at(0);
  const bool distorted = first.distortion.model == Distortion::Model::kBrown;
  Put<uint64_t>(&out.cameras, 1);
  Put<uint32_t>(&out.cameras, 7);
  Put<int32_t>(&out.cameras, distorted ? 4 : 1);
  Put<uint64_t>(&out.cameras, first.captured_camera.width);
  Put<uint64_t>(&out.cameras, first.captured_camera.height);
  const Camera& c = first.captured_camera;
  for (double v : {c.fx, c.fy, c.cx, c.cy}) Put(&out.cameras, v);
  for (int i = 0; distorted && i < 4; ++i) Put(&out.cameras, first.distortion.k[i]);

  Put<uint64_t>(&out.images, scene.views.size());
  for (size_t v = 0; v < scene.views.size(); ++v) {
    const View& view = scene.views[v];
    const Pose& pose = view.cam_from_world;
    Put<uint32_t>(&out.images, static_cast<uint32_t>(100 - v));  // in the reverse order of names
    for (double x : {pose.rotation.w(), pose.rotation.x(), pose.rotation.y(), pose.rotation.z()}) {
      Put(&out.images, x);
    }
    for (int k = 0; k < 3; ++k) Put(&out.images, pose.translation[k]);
    Put<uint32_t>(&out.images, 7);
    out.images += view.name + '\0';
    Put<uint64_t>(&out.images, 1);
    Put(&out.images, 3.5);
    Put(&out.images, 4.5);
    Put<int64_t>(&out.images, -1);
  }
  Put<uint64_t>(&out.points, scene.points.size());
  for (size_t i = 0; i < scene.points.size(); ++i) {
    const SparsePoint& point = scene.points[i];
    Put<uint64_t>(&out.points, i + 1);
    for (int k = 0; k < 3; ++k) Put(&out.points, point.position[k]);
    out.points += "abc";
    Put(&out.points, point.reprojection_error_px);
    Put<uint64_t>(&out.points, point.views.size());
    for (int v : point.views) {
      Put<uint32_t>(&out.points, static_cast<uint32_t>(100 - v));
      Put<uint32_t>(&out.points, 0);
    }
  }
  return out;
}

void ExpectSameScene(const Scene& got, const Scene& expected) {
  ASSERT_EQ(got.views.size(), expected.views.size());
  for (size_t i = 0; i < got.views.size(); ++i) {
    const View& g = got.views[i];
    const View& e = expected.views[i];
    EXPECT_EQ(g.name, e.name);
    EXPECT_EQ(g.image_file, e.image_file);
    EXPECT_EQ(g.captured_camera.width, e.captured_camera.width);
    EXPECT_NEAR(g.captured_camera.fx, e.captured_camera.fx, 1e-9);
    EXPECT_NEAR(g.captured_camera.fy, e.captured_camera.fy, 1e-9);
    EXPECT_NEAR(g.captured_camera.cy, e.captured_camera.cy, 1e-9);
    EXPECT_NEAR(g.camera.fx, e.camera.fx, 1e-9);
    EXPECT_EQ(g.distortion.model, e.distortion.model);
    for (int k = 0; k < 8; ++k) EXPECT_NEAR(g.distortion.k[k], e.distortion.k[k], 1e-12);
    EXPECT_LT(g.cam_from_world.rotation.angularDistance(e.cam_from_world.rotation), 1e-7);
    EXPECT_LT((g.cam_from_world.translation - e.cam_from_world.translation).norm(), 1e-9);
  }
  ASSERT_EQ(got.points.size(), expected.points.size());
  for (size_t i = 0; i < got.points.size(); ++i) {
    EXPECT_LT((got.points[i].position - expected.points[i].position).norm(), 1e-12);
    EXPECT_EQ(got.points[i].views, expected.points[i].views);
    EXPECT_EQ(got.points[i].reprojection_error_px, expected.points[i].reprojection_error_px);
  }
}

TEST(Colmap, ReadsBinaryModel) {
  const ScratchFolder folder;
  const Scene scene = ArcScene(4, {Distortion::Model::kBrown, {-0.1, 0.01, 1e-3, 2e-3}});
  WritePhotos(scene, folder.path());
  MakeBinary(scene).Write(folder.path() / "sparse/0");
  ExpectSameScene(ReadColmapModel(folder.path() / "sparse/0", folder.path()), scene);
}

TEST(Colmap, TextRoundTrips) {
  for (const Distortion& distortion :
       {Distortion{},
        Distortion{Distortion::Model::kBrown, {-0.1, 0.01, 1e-3, 2e-3}},
        Distortion{Distortion::Model::kBrown, {-0.1, 0.01, 1e-3, 2e-3, 0.01, 0.02, 0.03, 0.04}},
        Distortion{Distortion::Model::kFisheye, {0.05, -0.01, 0.002, 0.001}}}) {
    const ScratchFolder folder;
    Scene scene = ArcScene(3, distortion);
    scene.points[0].views = {0, 2};
    WritePhotos(scene, folder.path());
    WriteColmapText(scene, folder.path() / "sparse");
    ExpectSameScene(ReadColmapModel(folder.path() / "sparse", folder.path()), scene);
  }
}

TEST(Colmap, ExportAddsWorldOffset) {
  const ScratchFolder folder;
  Scene scene = ArcScene(3);
  WritePhotos(scene, folder.path());
  scene.world_offset = {5e5, -4e6, 120.0};
  WriteColmapText(scene, folder.path());
  const Scene far = ReadColmapModel(folder.path(), folder.path());
  EXPECT_LT((far.points[0].position - scene.points[0].position - scene.world_offset).norm(), 1e-6);
  const Eigen::Vector3d p = scene.views[1].cam_from_world.Apply(scene.points[0].position);
  EXPECT_LT((far.views[1].cam_from_world.Apply(far.points[0].position) - p).norm(), 1e-6);
}

TEST(Colmap, ReadsTextWithCommentsBlanksAndCrLf) {
  const ScratchFolder folder;
  Scene scene = ArcScene(2);
  scene.views[0].name = "a b.png";
  scene.views[0].image_file = "images/a b.png";
  scene.views[1].name = "c/d.png";
  scene.views[1].image_file = "images/c/d.png";
  WritePhotos(scene, folder.path());
  WriteFileAtomic(folder.path() / "cameras.txt",
                  "# comment\r\n\r\n1 SIMPLE_PINHOLE 48 32 50 24 16\r\n");
  // The second line of an image may be empty, and the last one missing.
  WriteFileAtomic(folder.path() / "images.txt",
                  "# comment\r\n9 1 0 0 0 +0.5 0 2e0 1 a b.png\r\n\r\n3 1 0 0 0 0 0 0 1 c/d.png");
  WriteFileAtomic(folder.path() / "points3D.txt", "# none\n");
  const Scene read = ReadColmapModel(folder.path(), folder.path());
  ASSERT_EQ(read.views.size(), 2u);
  EXPECT_EQ(read.views[0].name, "a b.png");
  EXPECT_EQ(read.views[0].cam_from_world.translation, Eigen::Vector3d(0.5, 0, 2));
  EXPECT_EQ(read.views[1].image_file, "images/c/d.png");
  EXPECT_TRUE(read.points.empty());
}

// Photos 0001.png, 0002.png and "l/a b.png" with times from a file.
class ColmapTimes : public testing::Test {
 protected:
  ColmapTimes() {
    Scene scene = ArcScene(3);
    scene.views[2].name = "l/a b.png";
    scene.views[2].image_file = "images/l/a b.png";
    WritePhotos(scene, folder_.path());
    WriteColmapText(scene, folder_.path() / "sparse/0");
  }
  Scene Read(const std::string& times) {
    warnings_.clear();
    WriteFileAtomic(folder_.path() / "times.txt", times);
    return ReadColmapModel(folder_.path() / "sparse/0", folder_.path(), &warnings_, &cameras_);
  }
  std::string Said(const std::string& times) {
    return Refusal([&] { Read(times); });
  }
  ScratchFolder folder_;
  std::vector<std::string> warnings_, cameras_;
};

TEST_F(ColmapTimes, ViewsGetMomentsOfTheirLines) {
  const Scene scene =
      Read("# SECONDS NAME\r\n\r\n2.5 l/a b.png \r\n  +2e0\t0001.png\n3 unplaced.png\n4 0002.png");
  EXPECT_EQ(scene.views[0].moment, (Moment{0.0, 0}));
  EXPECT_EQ(scene.views[1].moment, (Moment{2.0, 0}));
  EXPECT_EQ(scene.views[2].moment, (Moment{0.5, 0}));
  EXPECT_EQ(cameras_.size(), 1u);
  EXPECT_TRUE(warnings_.empty());
}

TEST_F(ColmapTimes, FoldersAreCamerasIfPhotosShareTime) {
  const Scene scene = Read("1 0001.png\n2 0002.png\n1 l/a b.png\n");
  EXPECT_EQ(cameras_, (std::vector<std::string>{"", "l"}));
  EXPECT_EQ(scene.views[2].moment, (Moment{0.0, 1}));
  EXPECT_THAT(
      Said("1 0001.png\n1 0002.png\n2 l/a b.png\n"),
      HasSubstr("times.txt: line 1 (0001.png) and times.txt: line 2 (0002.png) are of one "
                "camera and one time (1); remove one of them, or give each camera a folder"));
}

TEST_F(ColmapTimes, RefusesTimesForSomePhotosOnly) {
  EXPECT_THAT(
      Said("1 0001.png\n2 0003.png\n"),
      HasSubstr("times.txt has no time for 2 of the COLMAP model's 3 photos (0002.png, l/a "
                "b.png), but 0001.png has one; give it to every photo, or remove the file"));
  for (const char* other : {"1 elsewhere.png\n", "# nothing\n"}) {
    EXPECT_FALSE(Read(other).views[0].moment) << other;
    ASSERT_EQ(warnings_.size(), 1u);
    EXPECT_THAT(warnings_[0], HasSubstr("names no photo as the COLMAP model does (0001.png, "));
    EXPECT_TRUE(cameras_.empty());
  }
}

TEST_F(ColmapTimes, NamesNumberOfBadLine) {
  EXPECT_EQ(Said("#\n\n0001.png 1\n"),
            "times.txt: line 3: \"0001.png\" is not a number of seconds; a line is SECONDS NAME");
  EXPECT_THAT(Said("0,5 0001.png\n"), HasSubstr("line 1: \"0,5\" is not a number of seconds"));
  EXPECT_EQ(Said("1 0001.png\n2 \r\n"), "times.txt: line 2 names no photo; a line is SECONDS NAME");
  EXPECT_EQ(Said("nan 0001.png\n"),
            "times.txt: line 1: the time of 0001.png is nan; it must be finite");
  EXPECT_EQ(Said("1 0001.png\n2 0002.png\n3 0001.png\n"),
            "times.txt: line 3: 0001.png has a time already (times.txt: line 1); remove one of the "
            "two lines");
  EXPECT_THAT(Said("1 a\x01.png\n"), HasSubstr("times.txt: line 1: the name of an image holds"));
}

TEST(Colmap, ReadsEveryCameraModel) {
  struct Case {
    const char* model;
    std::vector<double> parameters;
    double fy;
    Distortion distortion;
  };
  using Model = Distortion::Model;
  const std::vector<Case> cases = {
      {"SIMPLE_PINHOLE", {50, 24, 16}, 50, {}},
      {"PINHOLE", {50, 60, 24, 16}, 60, {}},
      {"SIMPLE_RADIAL", {50, 24, 16, 0.1}, 50, {Model::kBrown, {0.1}}},
      {"RADIAL", {50, 24, 16, 0.1, 0.2}, 50, {Model::kBrown, {0.1, 0.2}}},
      {"OPENCV", {50, 60, 24, 16, 1, 2, 3, 4}, 60, {Model::kBrown, {1, 2, 3, 4}}},
      {"OPENCV_FISHEYE", {50, 60, 24, 16, 1, 2, 3, 4}, 60, {Model::kFisheye, {1, 2, 3, 4}}},
      {"FULL_OPENCV",
       {50, 60, 24, 16, 1, 2, 3, 4, 5, 6, 7, 8},
       60,
       {Model::kBrown, {1, 2, 3, 4, 5, 6, 7, 8}}},
      {"SIMPLE_RADIAL_FISHEYE", {50, 24, 16, 0.1}, 50, {Model::kFisheye, {0.1}}},
      {"RADIAL_FISHEYE", {50, 24, 16, 0.1, 0.2}, 50, {Model::kFisheye, {0.1, 0.2}}}};
  for (const Case& c : cases) {
    const ColmapCamera camera = MakeColmapCamera(c.model, 48, 32, c.parameters, "camera 1");
    EXPECT_EQ(camera.camera.fx, 50) << c.model;
    EXPECT_EQ(camera.camera.fy, c.fy) << c.model;
    EXPECT_EQ(camera.camera.cx, 24) << c.model;
    EXPECT_EQ(camera.camera.cy, 16) << c.model;
    EXPECT_EQ(camera.distortion.model, c.distortion.model) << c.model;
    EXPECT_EQ(camera.distortion.k, c.distortion.k) << c.model;
    std::vector<double> cut = c.parameters;
    cut.pop_back();
    EXPECT_THROW(MakeColmapCamera(c.model, 48, 32, cut, "camera 1"), Error) << c.model;
  }
  for (const char* model : {"FOV", "THIN_PRISM_FISHEYE"}) {
    EXPECT_THAT(Refusal([&] { ColmapParameterCount(model, "cameras.bin: camera 1"); }),
                HasSubstr(std::string("camera model ") + model + ", which is not supported"));
  }
  EXPECT_THAT(Refusal([] { ColmapModelName(11, "camera 1"); }), HasSubstr("number 11"));
  EXPECT_THAT(Refusal([] {
                MakeColmapCamera("PINHOLE", 48, 32, {50, 0, 1, 1}, "camera 1");
              }),
              HasSubstr("focal length"));
  EXPECT_THAT(Refusal([] {
                MakeColmapCamera("PINHOLE", 0, 32, {50, 50, 1, 1}, "camera 1");
              }),
              HasSubstr("0 x 32 px"));
}

TEST(Colmap, RefusesBinaryFilesTruncatedAnywhere) {
  const Scene scene = ArcScene(2);
  BinaryModel good = MakeBinary(scene);
  const ScratchFolder folder;
  const auto refused = [&](std::string BinaryModel::*part) {
    const std::string whole = good.*part;
    for (size_t length = 0; length < whole.size(); length += 1 + whole.size() / 400) {
      BinaryModel model = good;
      (model.*part).resize(length);
      model.Write(folder.path());
      const std::string said = Refusal([&] { LoadColmapModel(folder.path()); });
      ASSERT_THAT(said, HasSubstr(".bin")) << length;
      ASSERT_EQ(said.find('\n'), std::string::npos);
    }
  };
  refused(&BinaryModel::cameras);
  refused(&BinaryModel::images);
  refused(&BinaryModel::points);
}

TEST(Colmap, RefusesHugeCountsWithoutAllocating) {
  BinaryModel model = MakeBinary(ArcScene(2));
  const ScratchFolder folder;
  const uint64_t huge = uint64_t{1} << 61;
  std::memcpy(model.points.data(), &huge, 8);
  model.Write(folder.path());
  EXPECT_THAT(
      Refusal([&] { LoadColmapModel(folder.path()); }),
      HasSubstr("points3D.bin is truncated or damaged: it claims 2305843009213693952 points"));
  model = MakeBinary(ArcScene(2));
  // The observation count of the first image: after its fixed part and the name.
  std::memcpy(model.images.data() + 8 + 64 + 9, &huge, 8);
  model.Write(folder.path());
  EXPECT_THAT(Refusal([&] { LoadColmapModel(folder.path()); }), HasSubstr("observations of image"));
}

TEST(Colmap, RandomDamageNeverCrashes) {
  const Scene scene = ArcScene(2);
  const BinaryModel good = MakeBinary(scene);
  const ScratchFolder folder;
  WritePhotos(scene, folder.path());
  Random random(3);
  for (int i = 0; i < 150; ++i) {
    BinaryModel model = good;
    for (std::string* part : {&model.cameras, &model.images, &model.points}) {
      (*part)[random.NextBelow(static_cast<uint32_t>(part->size()))] ^=
          static_cast<char>(1u << random.NextBelow(8));
    }
    model.Write(folder.path() / "sparse");
    Refusal([&] { ReadColmapModel(folder.path() / "sparse", folder.path()); });
  }
}

TEST(Colmap, NamesNonFiniteNumbers) {
  const ScratchFolder folder;
  Scene scene = ArcScene(2);
  const double nan = std::nan("");
  scene.points[16].position.y() = nan;
  MakeBinary(scene).Write(folder.path());
  EXPECT_EQ(Refusal([&] { LoadColmapModel(folder.path()); }),
            "points3D.bin: point 17 has a NaN coordinate");
  scene = ArcScene(2);
  scene.views[1].cam_from_world.translation.x() = std::numeric_limits<double>::infinity();
  MakeBinary(scene).Write(folder.path());
  EXPECT_EQ(Refusal([&] { LoadColmapModel(folder.path()); }),
            "images.bin: image 0002.png has a pose that is not finite");
  const ScratchFolder text;
  WriteColmapText(ArcScene(2), text.path());
  WriteFileAtomic(text.path() / "points3D.txt", "5 0 nan 0 1 2 3 0.5\n");
  EXPECT_EQ(Refusal([&] { LoadColmapModel(text.path()); }),
            "points3D.txt: line 1: point 5 has a NaN coordinate");
  WriteFileAtomic(text.path() / "points3D.txt", "5 0 1e999 0 1 2 3 0.5\n");
  EXPECT_THAT(Refusal([&] { LoadColmapModel(text.path()); }),
              HasSubstr("\"1e999\" is not a number"));
}

TEST(Colmap, RefusesInconsistentModels) {
  const ScratchFolder folder;
  const Scene scene = ArcScene(2);
  WriteColmapText(scene, folder.path());
  EXPECT_EQ(Refusal([&] { ReadColmapModel(folder.path(), folder.path()); }),
            "the COLMAP model names 2 photos, of which 0 are among those given (missing: 0001.png, "
            "0002.png); give the photos that the poses were computed from");
  WritePhotos(scene, folder.path());
  EXPECT_EQ(Refusal([&] { ReadColmapModel(folder.path(), folder.path()); }), "");
  const std::string images = ReadFile(folder.path() / "images.txt");
  WriteFileAtomic(folder.path() / "images.txt", "1 1 0 0 0 0 0 0 44 0001.png\n\n");
  EXPECT_THAT(Refusal([&] { ReadColmapModel(folder.path(), folder.path()); }),
              HasSubstr("refers to camera 44"));
  WriteFileAtomic(folder.path() / "images.txt", "1 1 0 0 0 0 0 0 1 ../../secret.png\n\n");
  EXPECT_THAT(Refusal([&] { ReadColmapModel(folder.path(), folder.path()); }),
              HasSubstr("relative paths"));
  WriteFileAtomic(folder.path() / "images.txt", "1 0 0 0 0 0 0 0 1 0001.png\n\n");
  EXPECT_THAT(Refusal([&] { ReadColmapModel(folder.path(), folder.path()); }),
              HasSubstr("zero rotation"));
  WriteFileAtomic(folder.path() / "images.txt", images);
  WriteFileAtomic(folder.path() / "points3D.txt", "1 0 0 0 1 2 3 0.5 99 0\n");
  EXPECT_THAT(Refusal([&] { ReadColmapModel(folder.path(), folder.path()); }),
              HasSubstr("refers to image 99"));
  fs::remove(folder.path() / "points3D.txt");
  EXPECT_THAT(Refusal([&] { ReadColmapModel(folder.path(), folder.path()); }),
              HasSubstr("has no points3D.txt"));
}

TEST(Colmap, ScalesCamerasAndRefusesOtherShapes) {
  const ScratchFolder folder;
  Scene scene = ArcScene(2);
  for (View& view : scene.views) view.captured_camera = {97, 64, 100.0, 102.0, 49.0, 30.0};
  WriteColmapText(scene, folder.path());
  for (View& view : scene.views) view.captured_camera = {48, 32, 1, 1, 1, 1};
  WritePhotos(scene, folder.path());
  const Scene read = ReadColmapModel(folder.path(), folder.path());
  EXPECT_EQ(read.views[0].captured_camera.width, 48);
  EXPECT_NEAR(read.views[0].captured_camera.fy, 51.0, 1e-9);
  EXPECT_NEAR(read.views[0].captured_camera.cx, 49.0 * 48 / 97, 1e-9);
  WriteFileAtomic(folder.path() / "images/0002.png", EncodePng8(GradientPhoto(48, 40, 1)));
  const std::string said = Refusal([&] { ReadColmapModel(folder.path(), folder.path()); });
  EXPECT_THAT(said, HasSubstr("0002.png has 48 x 40 px"));
  EXPECT_THAT(said, HasSubstr("97 x 64 px"));
}

// Turning the pixels of a photo with its EXIF orientation and turning its camera must agree.
TEST(Colmap, RotatesCamerasByExifOrientation) {
  for (int orientation : {1, 3, 6, 8}) {
    Photo photo{"a.jpg", "images/a.jpg", 48, 32, orientation};
    photo.width = orientation >= 5 ? 32 : 48;
    photo.height = orientation >= 5 ? 48 : 32;
    const Distortion distortion{Distortion::Model::kBrown, {-0.1, 0.01, 0.02, -0.01}};
    View stored = ArcScene(1, distortion).views[0];
    View turned = stored;
    FitViewToPhoto(photo, &turned);
    EXPECT_EQ(turned.captured_camera.width, photo.width);
    EXPECT_EQ(turned.camera.height, photo.height);
    for (const SparsePoint& point : ArcScene(1).points) {
      const Eigen::Vector2d before = ProjectCaptured(
          stored.captured_camera, stored.distortion, stored.cam_from_world.Apply(point.position));
      const Eigen::Vector2d after = ProjectCaptured(
          turned.captured_camera, turned.distortion, turned.cam_from_world.Apply(point.position));
      Eigen::Vector2d expected = before;
      if (orientation == 3) expected = {48 - before.x(), 32 - before.y()};
      if (orientation == 6) expected = {32 - before.y(), before.x()};
      if (orientation == 8) expected = {before.y(), 48 - before.x()};
      EXPECT_LT((after - expected).norm(), 1e-9) << orientation;
    }
  }
  Photo mirrored{"a.jpg", "images/a.jpg", 48, 32, 2, 48, 32};
  View view = ArcScene(1).views[0];
  EXPECT_THAT(Refusal([&] { FitViewToPhoto(mirrored, &view); }), HasSubstr("mirrored"));
}

}  // namespace
}  // namespace color3d
