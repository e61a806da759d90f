#include "core/scene/relief.h"

#include <gtest/gtest.h>

namespace color3d {
namespace {

TEST(Relief, GroundIsNearerBelowFoot) {
  const Relief relief{.horizon = 0.4, .foot = 0.6, .backdrop_depth = 3.0};
  EXPECT_DOUBLE_EQ(relief.Depth(0.0), 3.0);
  EXPECT_DOUBLE_EQ(relief.Depth(0.6), 3.0);
  EXPECT_DOUBLE_EQ(relief.Depth(0.8), 1.5);  // twice as far below the horizon
  EXPECT_DOUBLE_EQ(relief.Depth(1.0), 1.0);
}

TEST(Relief, GroundIsPlane) {
  const Camera camera{.width = 80, .height = 60, .fx = 70, .fy = 70, .cx = 40, .cy = 30};
  const Relief relief{.horizon = 0.5, .foot = 0.6, .backdrop_depth = 4.0};
  // The horizon in the principal point's row: the plane is level, y is the camera's height.
  for (const Eigen::Vector3d& point : ReliefPoints(relief, camera, 500)) {
    const double row = camera.Project(point).y() / camera.height;
    if (row > relief.foot) {
      EXPECT_NEAR(point.y(), 4.0 * 6.0 / 70.0, 1e-12);
    } else {
      EXPECT_DOUBLE_EQ(point.z(), 4.0);
    }
  }
}

TEST(Relief, PointsCoverPicture) {
  const Camera camera{.width = 81, .height = 59, .fx = 70, .fy = 70, .cx = 40, .cy = 30};
  const auto points = ReliefPoints(Relief(), camera, 500);
  EXPECT_NEAR(static_cast<double>(points.size()), 500.0, 50.0);
  for (const Eigen::Vector3d& point : points) {
    EXPECT_TRUE(camera.Contains(camera.Project(point)));
  }
  EXPECT_FALSE(ReliefPoints(Relief(), camera, 0).empty());
}

TEST(Relief, MovingObjectsAreBeforeBackdrop) {
  const Relief relief = FitRelief({0.7, 0.75, 0.8, 0.72});
  EXPECT_LT(relief.foot, 0.7);
  EXPECT_GT(relief.Depth(relief.foot), relief.Depth(0.7));
}

TEST(Relief, StaysWithinBoundsForAnyFeet) {
  for (const auto& feet : std::vector<std::vector<double>>{{}, {0.0}, {1.0}, {0.0, 1.0}}) {
    const Relief relief = FitRelief(feet);
    EXPECT_LT(relief.horizon, relief.foot);
    EXPECT_LT(relief.foot, 1.0);
    EXPECT_GE(relief.Depth(1.0), 0.25 * relief.backdrop_depth - 1e-12);
    EXPECT_LT(relief.Depth(1.0), relief.backdrop_depth);
  }
}

}  // namespace
}  // namespace color3d
