#include "core/view/path/turn.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "core/view/path/camera_path.h"

namespace color3d {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180.0;
const Vector3d kUp = Vector3d(0.2, -0.9, 0.3).normalized();
const Vector3d kFocus(1.0, 2.0, 3.0);

// A level camera at this angle around the focus, `above` it, that looks at it.
View ViewAt(double degrees, double distance = 4.0, double above = 1.0) {
  const Vector3d side = kUp.unitOrthogonal();
  const Vector3d position =
      kFocus + above * kUp + distance * (Eigen::AngleAxisd(degrees * kDegree, kUp) * side);
  const Vector3d z = (kFocus - position).normalized();
  const Vector3d x = z.cross(kUp).normalized();
  Eigen::Matrix3d axes;
  axes << x, z.cross(x), z;
  View view;
  view.camera = {640, 480, 500.0, 510.0, 330.0, 250.0};
  view.cam_from_world.rotation = Eigen::Quaterniond(axes).conjugate();
  view.cam_from_world.translation = -(view.cam_from_world.rotation * position);
  return view;
}

Scene SceneOf(const std::vector<double>& degrees) {
  Scene scene;
  for (const double angle : degrees) scene.views.push_back(ViewAt(angle));
  return scene;
}

Turn TurnOf(const Scene& scene, int key) {
  return TurnOf(scene, key, PlaceScene(scene, key, kFocus));
}

TEST(TurnTest, SurroundingPhotosGiveCircleOthersSway) {
  std::vector<double> ring;
  for (int i = 0; i < 8; ++i) ring.push_back(45.0 * i);
  EXPECT_TRUE(TurnOf(SceneOf(ring), 3).around);
  ring.resize(6);  // a quarter and more without photos
  EXPECT_FALSE(TurnOf(SceneOf(ring), 3).around);
  // The key view in the middle of a wide arc: equally to both sides.
  Turn turn = TurnOf(SceneOf({-40, -20, 0, 20, 40}), 2);
  EXPECT_FALSE(turn.around);
  EXPECT_NEAR(turn.middle, 0.0, 1e-9);
  EXPECT_NEAR(turn.reach, 0.35, 1e-9);
  // At an end of it: to the other side only.
  turn = TurnOf(SceneOf({-60, -40, -20, 0}), 3);
  EXPECT_NEAR(std::abs(turn.middle), turn.reach, 1e-9);
  // A narrow arc: not far beyond it.
  turn = TurnOf(SceneOf({-10, 0, 10}), 1);
  EXPECT_NEAR(turn.reach, 10.0 * kDegree, 0.01);
  EXPECT_NEAR(TurnOf(SceneOf({0}), 0).reach, 0.1, 1e-9);
}

TEST(TurnTest, PathBeginsAtKeyViewAndStaysNearPhotos) {
  const std::vector<double> arc = {-75, -50, -25, 0};
  for (int key = 0; key < 4; ++key) {
    const Scene scene = SceneOf(arc);
    const ScenePlacement placement = PlaceScene(scene, key, kFocus);
    const Turn turn = TurnOf(scene, key, placement);
    const auto angle = [](const Vector3d& p) { return std::atan2(p.x(), p.z()); };
    double low = 10.0, high = -10.0;
    for (const View& view : scene.views) {
      const double at = angle(placement.Apply(view.cam_from_world.Center()));
      low = std::min(low, at);
      high = std::max(high, at);
    }
    const Vector3d home = placement.Apply(scene.views[key].cam_from_world.Center());
    EXPECT_LT((TurnPosition(turn, 0.0) - home).norm(), 1e-9);
    for (int i = 0; i <= 100; ++i) {
      const double at = angle(TurnPosition(turn, i / 100.0));
      EXPECT_GE(at, low - 1e-9);
      EXPECT_LE(at, high + 1e-9);
    }
  }
}

TEST(TurnTest, PathFollowsHeightOfNearbyPhotos) {
  Scene scene;
  for (int i = 0; i < 24; ++i) {
    const double angle = 15.0 * i;
    scene.views.push_back(ViewAt(angle, 4.0, 1.0 + 0.5 * std::cos(angle * kDegree)));
    scene.views.push_back(ViewAt(angle, 0.5, 6.0));  // from above
  }
  const ScenePlacement placement = PlaceScene(scene, 0, kFocus);
  const Turn turn = TurnOf(scene, 0, placement);
  ASSERT_TRUE(turn.around);
  const auto height = [](const Vector3d& p) { return std::atan2(p.y(), std::hypot(p.x(), p.z())); };
  EXPECT_NEAR(height(TurnPosition(turn, 0.0)), std::atan2(1.5, 4.0), 0.02);
  EXPECT_NEAR(height(TurnPosition(turn, 0.25)), std::atan2(1.0, 4.0), 0.04);
  EXPECT_NEAR(height(TurnPosition(turn, 0.5)), std::atan2(0.5, 4.0), 0.06);
}

TEST(TurnFramesTest, LoopClosesUprightAndCentered) {
  std::vector<double> ring;
  for (int i = 0; i < 12; ++i) ring.push_back(30.0 * i);
  for (const std::vector<double>& angles : {ring, {-30.0, -10.0, 0.0, 25.0}}) {
    const Scene scene = SceneOf(angles);
    constexpr int kFrames = 90;
    const std::vector<PathCamera> frames =
        TurnFrames(scene, 2, kFocus, FrameShares(kFrames, false, true));
    ASSERT_EQ(frames.size(), static_cast<size_t>(kFrames));
    const Vector3d level = UpVector(scene.views);  // estimated from the cameras
    const Vector3d key = scene.views[2].cam_from_world.Center();
    EXPECT_LT((frames[0].cam_from_world.Center() - key).norm(), 1e-9);
    double longest = 0.0, shortest = 1e9;
    for (int i = 0; i < kFrames; ++i) {
      const Pose& pose = frames[i].cam_from_world;
      const Vector3d up = pose.rotation.conjugate() * -Vector3d::UnitY();
      const Vector3d right = pose.rotation.conjugate() * Vector3d::UnitX();
      EXPECT_NEAR(right.dot(level), 0.0, 1e-9);
      EXPECT_GT(up.dot(kUp), 0.9);
      const Vector3d seen = pose.Apply(kFocus);
      EXPECT_LT(seen.head<2>().norm(), 1e-9);
      EXPECT_NEAR(seen.z(), std::sqrt(17.0), 1e-9) << "all photos are at the same distance";
      EXPECT_EQ(frames[i].camera.cx, 320.0);
      EXPECT_EQ(frames[i].camera.fy, 510.0);
      const double step =
          (pose.Center() - frames[(i + 1) % kFrames].cam_from_world.Center()).norm();
      longest = std::max(longest, step);
      shortest = std::min(shortest, step);
    }
    EXPECT_LT(longest, 1.1 * 2.0 * std::numbers::pi * 4.0 / kFrames) << "also from last to first";
    if (angles.size() == 12) {
      EXPECT_GT(shortest, 0.99 * longest);
    }
  }
}

TEST(TurnFramesTest, OverheadKeyViewHasUpVector) {
  Scene scene;
  for (int i = 0; i < 3; ++i) {
    View view;
    view.camera = {64, 48, 50, 50, 32, 24};
    view.cam_from_world.translation = {0.0, 0.0, 4.0};
    scene.views.push_back(view);
  }
  scene.views[1].cam_from_world.translation = {0.5, 0.0, 4.0};
  for (const PathCamera& frame :
       TurnFrames(scene, 0, Vector3d::Zero(), FrameShares(7, true, true))) {
    EXPECT_TRUE(frame.cam_from_world.rotation.coeffs().allFinite());
    EXPECT_TRUE(frame.cam_from_world.translation.allFinite());
  }
}

}  // namespace
}  // namespace color3d
