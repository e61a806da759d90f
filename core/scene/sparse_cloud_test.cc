#include "core/scene/sparse_cloud.h"

#include <gtest/gtest.h>

#include "tests/support/scenes/test_scenes.h"

namespace color3d {
namespace {

TEST(SparseCloud, FindsFocusOfAnyCameraArrangement) {
  EXPECT_LT(FocusPoint(ArcScene(7)).norm(), 0.05);
  Scene parallel = ArcScene(5);
  for (int i = 0; i < 5; ++i) {
    parallel.views[i].cam_from_world.rotation.setIdentity();
    parallel.views[i].cam_from_world.translation = Eigen::Vector3d(-i, 0, 0);
  }
  const Eigen::Vector3d focus = FocusPoint(parallel);
  EXPECT_NEAR(focus.x(), 2.0, 1e-6);
  EXPECT_NEAR(focus.z(), 6.0, 1e-6);  // three baselines of 2
  Scene diverging = ArcScene(5);
  for (View& view : diverging.views) {
    const Eigen::Vector3d c = view.cam_from_world.Center();
    view.cam_from_world = LookAt(c, 2.0 * c);
  }
  const Eigen::Vector3d ahead = FocusPoint(diverging);
  int in_front = 0;
  for (const View& view : diverging.views) in_front += view.cam_from_world.Apply(ahead).z() > 0;
  EXPECT_GE(in_front, 3);
}

TEST(SparseCloud, GivesPointsWithoutBaselineOrOverlap) {
  Scene one_place = ArcScene(3);
  for (View& view : one_place.views) view.cam_from_world = one_place.views[0].cam_from_world;
  EXPECT_EQ(RandomPoints(one_place, 500, 1).size(), 500u);
  Scene apart = ArcScene(2);
  apart.views[0].cam_from_world = LookAt({0, 0, 0.1}, {0, 0, 5});
  apart.views[1].cam_from_world = LookAt({0, 0, -0.1}, {0, 0, -5});
  EXPECT_GT(RandomPoints(apart, 100, 1).size(), 0u);
}

}  // namespace
}  // namespace color3d
