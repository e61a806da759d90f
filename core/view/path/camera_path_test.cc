#include "core/view/path/camera_path.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

double AngleBetween(const Pose& a, const Pose& b) { return a.rotation.angularDistance(b.rotation); }

// Level cameras on an arc, at uneven distances, that look inwards; `up` is -y.
std::vector<PathCamera> Bow(int count) {
  std::vector<PathCamera> cameras;
  Random random(5);
  double angle = -1.0;
  for (int i = 0; i < count; ++i) {
    angle += 0.05 + 0.4 * random.NextUniform();
    PathCamera camera;
    camera.camera = {640, 480, 400.0 + 10.0 * i, 410.0 + 10.0 * i, 320.0, 240.0};
    camera.cam_from_world.rotation = Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitY()));
    // Every second one with the other sign: the same direction.
    if (i % 2 == 1) camera.cam_from_world.rotation.coeffs() *= -1.0;
    const Vector3d center(-3.0 * std::sin(angle), 0.1 * i, 4.0 - 3.0 * std::cos(angle));
    camera.cam_from_world.translation = -(camera.cam_from_world.rotation * center);
    cameras.push_back(camera);
  }
  return cameras;
}

TEST(SmoothPathTest, PassesThroughEveryCamera) {
  const std::vector<PathCamera> cameras = Bow(9);
  const SmoothPath path(cameras, 3.0);
  EXPECT_EQ(path.KnotAt(0), 0.0);
  EXPECT_EQ(path.KnotAt(8), 1.0);
  for (size_t i = 0; i < cameras.size(); ++i) {
    const PathCamera at = path.At(path.KnotAt(i));
    EXPECT_LT((at.cam_from_world.Center() - cameras[i].cam_from_world.Center()).norm(), 1e-9);
    EXPECT_LT(AngleBetween(at.cam_from_world, cameras[i].cam_from_world), 1e-7);
    EXPECT_NEAR(at.camera.fx, cameras[i].camera.fx, 1e-9);
    EXPECT_NEAR(at.camera.fy, cameras[i].camera.fy, 1e-9);
    EXPECT_EQ(at.camera.width, 640);
  }
}

TEST(SmoothPathTest, MovesEvenlyAndStaysUpright) {
  const std::vector<PathCamera> cameras = Bow(9);
  const SmoothPath path(cameras, 3.0);
  constexpr int kSteps = 400;
  double longest = 0.0, shortest = 1e9, most_turn = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const PathCamera a = path.At(static_cast<double>(i) / kSteps);
    const PathCamera b = path.At((i + 1.0) / kSteps);
    const double step = (a.cam_from_world.Center() - b.cam_from_world.Center()).norm() / 3.0 +
                        AngleBetween(a.cam_from_world, b.cam_from_world);
    longest = std::max(longest, step);
    shortest = std::min(shortest, step);
    most_turn = std::max(most_turn, AngleBetween(a.cam_from_world, b.cam_from_world));
    EXPECT_NEAR(a.cam_from_world.rotation.norm(), 1.0, 1e-12);
    const Vector3d up = a.cam_from_world.rotation.conjugate() * -Vector3d::UnitY();
    EXPECT_GT(up.dot(-Vector3d::UnitY()), 1.0 - 1e-9);
  }
  EXPECT_LT(longest, 1.5 * shortest);
  EXPECT_LT(most_turn, 0.02);
}

TEST(SmoothPathTest, AcceptsOneCameraAndEqualCameras) {
  const std::vector<PathCamera> bow = Bow(3);
  const SmoothPath still({bow[0]}, 1.0);
  for (const double share : {0.0, 0.3, 1.0, 7.0, -1.0}) {
    EXPECT_LT((still.At(share).cam_from_world.Center() - bow[0].cam_from_world.Center()).norm(),
              1e-9);
  }
  const SmoothPath path({bow[0], bow[0], bow[0], bow[1], bow[1], bow[2]}, 1.0);
  for (int i = 0; i <= 50; ++i) {
    const PathCamera at = path.At(i / 50.0);
    EXPECT_TRUE(at.cam_from_world.translation.allFinite());
    EXPECT_TRUE(std::isfinite(at.camera.fx));
    EXPECT_LT(at.cam_from_world.Center().norm(), 10.0);
  }
  EXPECT_THROW(SmoothPath({}, 1.0), Error);
  EXPECT_THROW(SmoothPath(bow, 0.0), Error);
  EXPECT_THROW(SmoothPath(bow, std::nan("")), Error);
}

TEST(FrameSharesTest, SupportsOnceBackAndForthAndLoop) {
  const std::vector<double> forth = FrameShares(101, false, false);
  EXPECT_EQ(forth.front(), 0.0);
  EXPECT_EQ(forth.back(), 1.0);
  EXPECT_NEAR(forth[50], 0.5, 1e-12);
  for (size_t i = 1; i < forth.size(); ++i) EXPECT_GT(forth[i], forth[i - 1]);
  EXPECT_LT(forth[1], 0.3 * (forth[50] - forth[49])) << "begins gently";
  const std::vector<double> bounce = FrameShares(100, true, false);
  EXPECT_EQ(bounce[0], 0.0);
  EXPECT_NEAR(bounce[50], 1.0, 1e-12);
  EXPECT_NEAR(bounce[99], bounce[1], 1e-12) << "the first frame comes next";
  const std::vector<double> around = FrameShares(4, false, true);
  EXPECT_EQ(around, (std::vector<double>{0.0, 0.25, 0.5, 0.75}));
  EXPECT_EQ(FrameShares(1, false, false), std::vector<double>{0.0});
}

TEST(CoverPictureTest, AddsNothingUnseenByOriginal) {
  const Camera camera{600, 400, 500.0, 510.0, 310.0, 190.0};
  for (const auto& [width, height] : {std::pair{300, 200}, {100, 300}, {302, 100}, {64, 64}}) {
    const Camera covered = CoverPicture(camera, width, height);
    EXPECT_EQ(covered.width, width);
    EXPECT_EQ(covered.height, height);
    EXPECT_NEAR(covered.fx / covered.fy, camera.fx / camera.fy, 1e-12);
    for (const double x : {0.0, static_cast<double>(width)}) {
      for (const double y : {0.0, static_cast<double>(height)}) {
        const Eigen::Vector2d before = camera.Project(covered.Ray(x, y));
        EXPECT_GT(before.x(), -1e-9);
        EXPECT_LT(before.x(), 600 + 1e-9);
        EXPECT_GT(before.y(), -1e-9);
        EXPECT_LT(before.y(), 400 + 1e-9);
      }
    }
  }
}

TEST(ViewsInOrderTest, SortsNumbersByValue) {
  Scene scene;
  for (const char* name : {"p1.png", "p10.png", "p2.png", "p02.png", "a9.png", "a.png"}) {
    scene.views.push_back({.name = name});
  }
  std::vector<std::string> names;
  for (const int view : ViewsInOrder(scene)) names.push_back(scene.views[view].name);
  EXPECT_EQ(
      names,
      (std::vector<std::string>{"a.png", "a9.png", "p1.png", "p02.png", "p2.png", "p10.png"}));
}

}  // namespace
}  // namespace color3d
