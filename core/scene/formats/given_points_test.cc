#include "core/scene/formats/given_points.h"

#include <fmt/core.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "core/scene/formats/point_ply.h"
#include "core/scene/import/import.h"
#include "tests/support/quiet_run.h"
#include "tests/support/scenes/scene_writers.h"
#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Not;

std::string AsciiPly(const std::vector<Eigen::Vector3d>& points) {
  std::string text = fmt::format(
      "ply\nformat ascii 1.0\ncomment by hand\nelement vertex {}\nproperty float x\n"
      "property float y\nproperty float z\nproperty uchar red\nend_header\n",
      points.size());
  for (const auto& p : points) text += fmt::format("{} {} {} 7\n", p.x(), p.y(), p.z());
  return text;
}

// Colours before doubles, so that offsets matter.
std::string BinaryPly(const std::vector<Eigen::Vector3d>& points, bool big_endian) {
  std::string bytes = fmt::format(
      "ply\r\nformat binary_{}_endian 1.0\r\nelement vertex {}\r\nproperty uchar red\r\n"
      "property double x\r\nproperty double y\r\nproperty double z\r\nelement face 0\r\n"
      "property list uchar int vertex_indices\r\nend_header\r\n",
      big_endian ? "big" : "little",
      points.size());
  for (const auto& p : points) {
    bytes += '\x07';
    for (int k = 0; k < 3; ++k) {
      char number[8];
      std::memcpy(number, &p[k], 8);
      if (big_endian) std::reverse(number, number + 8);
      bytes.append(number, 8);
    }
  }
  return bytes;
}

TEST(PointPly, ReadsEveryFormat) {
  const std::vector<Eigen::Vector3d> points = {{1, 2, 3}, {-0.5, 0.25, 1e6}};
  EXPECT_EQ(ReadPointPly(AsciiPly(points), "a.ply", 100), points);
  EXPECT_EQ(ReadPointPly(BinaryPly(points, false), "a.ply", 100), points);
  EXPECT_EQ(ReadPointPly(BinaryPly(points, true), "a.ply", 100), points);
}

TEST(PointPly, DropsNonFinitePointsAndThinsMany) {
  std::vector<Eigen::Vector3d> points(10, Eigen::Vector3d(1, 2, 3));
  points[3].y() = std::nan("");
  EXPECT_EQ(ReadPointPly(AsciiPly(points), "a.ply", 100).size(), 9u);
  EXPECT_EQ(ReadPointPly(BinaryPly(points, false), "a.ply", 100).size(), 9u);
  EXPECT_EQ(ReadPointPly(AsciiPly(points), "a.ply", 4).size(), 3u);  // 0, (3), 6, 9
}

TEST(PointPly, NamesDamagedFiles) {
  const std::string good = BinaryPly({{1, 2, 3}, {4, 5, 6}}, false);
  for (size_t length = 0; length < good.size(); ++length) {
    EXPECT_THAT(Refusal([&] { ReadPointPly(good.substr(0, length), "a.ply", 9); }),
                HasSubstr("a.ply"))
        << length;
  }
  EXPECT_THAT(
      Refusal([] { ReadPointPly("ply\nelement vertex 1\nend_header\n1 2 3\n", "a.ply", 9); }),
      HasSubstr("x, y and z"));
  EXPECT_THAT(Refusal([] { ReadPointPly("solid\n", "a.ply", 9); }), HasSubstr("no PLY"));
}

// An arc of cameras with transforms.json.
class GivenPoints : public testing::Test {
 protected:
  GivenPoints() {
    WritePhotos(scene_, folder_.path());
    WriteTransformsJson(scene_, folder_.path() / "transforms.json");
    for (const SparsePoint& point : scene_.points) points_.push_back(point.position);
  }
  void Say(const char* key, const nlohmann::json& value) {
    const fs::path file = folder_.path() / "transforms.json";
    nlohmann::json root = nlohmann::json::parse(ReadFile(file));
    root[key] = value;
    WriteFileAtomic(file, root.dump());
  }
  ImportResult Run() { return ImportScene(folder_.path(), scratch_.path(), {}, run_.control()); }
  void ExpectTheSamePoints(const ImportResult& result) {
    EXPECT_FALSE(result.random_points);
    ASSERT_EQ(result.scene.points.size(), points_.size());
    for (size_t i = 0; i < points_.size(); ++i) {
      EXPECT_LT((result.scene.points[i].position - points_[i]).norm(), 1e-5);
      EXPECT_EQ(result.scene.points[i].views.size(), scene_.views.size());
      EXPECT_LT(result.scene.points[i].reprojection_error_px, 0.0);
    }
    EXPECT_THAT(result.warnings, Each(Not(HasSubstr("random"))));
  }
  const Scene scene_ = ArcScene(4);
  std::vector<Eigen::Vector3d> points_;
  ScratchFolder folder_, scratch_;
  QuietRun run_;
};

TEST_F(GivenPoints, ReadsPointsOfTransforms) {
  Say("ply_file_path", "cloud/sparse.ply");
  fs::create_directories(folder_.path() / "cloud");
  WriteFileAtomic(folder_.path() / "cloud/sparse.ply", AsciiPly(points_));
  const ImportResult result = Run();
  ExpectTheSamePoints(result);
  EXPECT_THAT(result.warnings, Contains("geometry starts from 50 points of cloud/sparse.ply"));
}

TEST_F(GivenPoints, FindsPointsBesideBlenderFiles) {
  WriteFileAtomic(folder_.path() / "points3d.ply", BinaryPly(points_, false));
  ExpectTheSamePoints(Run());
}

// Poses are in the frame that applied_transform leads to; points of some programs are not.
TEST_F(GivenPoints, MovesPointsIntoFrameOfPoses) {
  Say("ply_file_path", "sparse_pc.ply");
  Say("applied_transform", {{1, 0, 0, 30}, {0, 0, 1, 0}, {0, -1, 0, 0}});
  const auto apply = [](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(p.x() + 30.0, p.z(), -p.y());
  };
  const auto undo = [](const Eigen::Vector3d& p) {
    return Eigen::Vector3d(p.x() - 30.0, -p.z(), p.y());
  };
  const auto write = [&](const std::function<Eigen::Vector3d(const Eigen::Vector3d&)>& f) {
    std::vector<Eigen::Vector3d> moved;
    for (const Eigen::Vector3d& p : points_) moved.push_back(f(p));
    WriteFileAtomic(folder_.path() / "sparse_pc.ply", BinaryPly(moved, false));
  };
  write([](const Eigen::Vector3d& p) { return p; });
  ExpectTheSamePoints(Run());
  write(undo);
  ExpectTheSamePoints(Run());
  write(apply);
  ExpectTheSamePoints(Run());
}

TEST_F(GivenPoints, WarnsOfUnusablePoints) {
  Say("ply_file_path", "../outside.ply");
  WriteFileAtomic(folder_.path().parent_path() / "outside.ply", AsciiPly(points_));
  EXPECT_THAT(Run().warnings,
              Contains(HasSubstr("the points in ../outside.ply, which transforms.json names, are "
                                 "not among the files given")));
  fs::remove(folder_.path().parent_path() / "outside.ply");
  Say("ply_file_path", "a.ply");
  WriteFileAtomic(folder_.path() / "a.ply", "ply\nformat ascii 1.0\n");
  ImportResult result = Run();
  EXPECT_TRUE(result.random_points);
  EXPECT_THAT(result.warnings, Contains(HasSubstr("the given points are not used: a.ply")));
  WriteFileAtomic(folder_.path() / "a.ply", AsciiPly({{1e7, 0, 0}, {0, 1e9, 0}}));
  EXPECT_THAT(Run().warnings, Contains(HasSubstr("none of the 2 points in a.ply")));
}

TEST_F(GivenPoints, AcceptsColmapPointsWithoutTracks) {
  WriteColmapText(scene_, folder_.path() / "sparse/0");
  std::string text;
  for (size_t i = 0; i < points_.size(); ++i) {
    const Eigen::Vector3d& p = points_[i];
    text += fmt::format("{} {} {} {} 154.0 132.0 65.0 0\n", i + 1, p.x(), p.y(), p.z());
  }
  WriteFileAtomic(folder_.path() / "sparse/0/points3D.txt", text);
  ExpectTheSamePoints(Run());
}

// Of the photos that saw a point one is left: where all points are like that, they are kept.
TEST_F(GivenPoints, KeepsPointsOfDeletedPhotos) {
  Scene scene = scene_;
  for (SparsePoint& point : scene.points) point.views = {0, 1};
  WriteColmapText(scene, folder_.path() / "sparse/0");
  fs::remove(folder_.path() / scene.views[0].image_file);
  const ImportResult result = Run();
  EXPECT_FALSE(result.random_points);
  EXPECT_EQ(result.scene.views.size(), 3u);
  EXPECT_EQ(result.scene.points.size(), points_.size());
  EXPECT_THAT(result.warnings, Contains(HasSubstr("were left out: 0001.png")));
}

}  // namespace
}  // namespace color3d
