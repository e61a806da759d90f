#include "core/augment/orbit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace color3d {
namespace {

// Looks from `center` along world z, turned about y by `yaw`.
View ViewAt(const Eigen::Vector3d& center, double yaw) {
  View view;
  view.camera = {100, 80, 90.0, 90.0, 50.0, 40.0};
  view.cam_from_world.rotation = Eigen::AngleAxisd(-yaw, Eigen::Vector3d::UnitY());
  view.cam_from_world.translation = -(view.cam_from_world.rotation * center);
  return view;
}

// Cameras on an arc of 5 units around `target`, looking at it.
Scene ArcScene(const Eigen::Vector3d& target) {
  Scene scene;
  for (const double yaw : {-0.4, -0.2, 0.0, 0.2, 0.4}) {
    const Eigen::Vector3d back(-std::sin(yaw), 0.0, -std::cos(yaw));
    scene.views.push_back(ViewAt(target + 5.0 * back, yaw));
  }
  return scene;
}

TEST(OrbitTest, FindsPointThatCamerasFace) {
  const Eigen::Vector3d target(1.0, -0.5, 3.0);
  const Scene scene = ArcScene(target);
  EXPECT_LT((CenterOfAttention(scene, 2, 4.0) - target).norm(), 1e-6);
  EXPECT_NEAR(OrbitAngle(scene, 2, target), 12.0 * std::numbers::pi / 180.0, 1e-9)
      << "0.4 rad, clamped to the plausible range";
}

TEST(OrbitTest, ParallelCamerasOrbitAtKeyDepth) {
  Scene scene;
  for (const double x : {-1.0, 0.0, 1.0}) scene.views.push_back(ViewAt({x, 0.0, 0.0}, 0.0));
  EXPECT_LT((CenterOfAttention(scene, 1, 7.0) - Eigen::Vector3d(0.0, 0.0, 7.0)).norm(), 1e-6);
  // Axes that meet far behind the surface that the key view shows.
  EXPECT_LT((CenterOfAttention(ArcScene({0.0, 0.0, 0.0}), 2, 0.5) - Eigen::Vector3d(0.0, 0.0, -4.5))
                .norm(),
            1e-6);
}

TEST(OrbitTest, MovesRightAndUpFacingCenter) {
  const Eigen::Vector3d target(0.0, 0.0, 5.0);
  const Pose pose = ViewAt({0.0, 0.0, 0.0}, 0.0).cam_from_world;
  const Pose right = OrbitPose(pose, target, 0.2, 0.0);
  EXPECT_NEAR(right.Center().x(), 5.0 * std::sin(0.2), 1e-9);
  EXPECT_LT((right.Apply(target) - target).norm(), 1e-9);
  const Pose up = OrbitPose(pose, target, 0.0, 0.1);
  EXPECT_NEAR(up.Center().y(), -5.0 * std::sin(0.1), 1e-9) << "y points down";
  EXPECT_LT((up.Apply(target) - target).norm(), 1e-9);
}

TEST(OrbitTest, HasAngleForSingleView) {
  Scene scene;
  scene.views.push_back(ViewAt({0.0, 0.0, 0.0}, 0.0));
  EXPECT_GT(OrbitAngle(scene, 0, {0.0, 0.0, 2.0}), 0.0);
  EXPECT_TRUE(CenterOfAttention(scene, 0, 2.0).allFinite());
}

}  // namespace
}  // namespace color3d
