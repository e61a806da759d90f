#include "core/scene/camera.h"

#include <gtest/gtest.h>

#include <cmath>

namespace color3d {
namespace {

const Camera kCamera{640, 480, 500.0, 510.0, 323.0, 236.0};

TEST(Camera, ScalesWithPicture) {
  const Camera half = kCamera.Scaled(320, 240);
  EXPECT_DOUBLE_EQ(half.fx, 250.0);
  EXPECT_DOUBLE_EQ(half.fy, 255.0);
  EXPECT_DOUBLE_EQ(half.cx, 161.5);
  EXPECT_DOUBLE_EQ(half.cy, 118.0);
  EXPECT_EQ(kCamera.FitWithin(1000).width, 640);
  EXPECT_EQ(kCamera.FitWithin(0).width, 640);
  const Camera small = kCamera.FitWithin(100);
  EXPECT_EQ(small.width, 100);
  EXPECT_EQ(small.height, 75);
  EXPECT_NEAR(small.fx / small.width, kCamera.fx / kCamera.width, 1e-12);
}

TEST(Camera, RayInvertsProject) {
  const Eigen::Vector2d pixel = kCamera.Project({0.2, -0.3, 2.0});
  EXPECT_DOUBLE_EQ(pixel.x(), 373.0);  // 500 * 0.1 + 323
  EXPECT_DOUBLE_EQ(pixel.y(), 159.5);  // 510 * -0.15 + 236
  EXPECT_LT((2.0 * kCamera.Ray(373.0, 159.5) - Eigen::Vector3d(0.2, -0.3, 2.0)).norm(), 1e-15);
  Pose pose;
  pose.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()));
  pose.translation = {0.5, -1.0, 2.0};
  const Eigen::Vector3d world(3.0, 4.0, 5.0);
  EXPECT_LT((pose.WorldFromCamera(pose.Apply(world)) - world).norm(), 1e-14);
}

TEST(Camera, ContainsFirstColumnButNotWidth) {
  EXPECT_TRUE(kCamera.Contains({0.0, 0.0}));
  EXPECT_TRUE(kCamera.Contains({639.99, 479.99}));
  EXPECT_FALSE(kCamera.Contains({640.0, 10.0}));
  EXPECT_FALSE(kCamera.Contains({10.0, 480.0}));
  EXPECT_FALSE(kCamera.Contains({-1e-9, 10.0}));
  EXPECT_FALSE(kCamera.Contains({std::nan(""), 10.0}));
}

}  // namespace
}  // namespace color3d
