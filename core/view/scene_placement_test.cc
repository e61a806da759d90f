#include "core/view/scene_placement.h"

#include <gtest/gtest.h>

#include "core/base/error.h"

namespace color3d {
namespace {

using Eigen::AngleAxisd;
using Eigen::Quaterniond;
using Eigen::Vector3d;

// A camera at `position` that looks at `target`, level against `up`, then rolled.
View Looking(const Vector3d& position,
             const Vector3d& target,
             const Vector3d& up,
             double roll = 0) {
  const Vector3d z = (target - position).normalized();
  const Vector3d x = z.cross(up).normalized();
  Eigen::Matrix3d axes;  // of the camera in the world, as columns: right, down, forward
  axes << x, z.cross(x), z;
  View view;
  view.camera = {60, 40, 50.0, 50.0, 30.0, 20.0};
  view.cam_from_world.rotation =
      Quaterniond(AngleAxisd(roll, Vector3d::UnitZ())) * Quaterniond(axes).conjugate();
  view.cam_from_world.translation = -(view.cam_from_world.rotation * position);
  return view;
}

TEST(UpVectorTest, CamerasLookingDownFromOneSideAreLevel) {
  const Vector3d up = Vector3d(0.2, -0.9, 0.3).normalized();
  const Vector3d side = up.unitOrthogonal();
  std::vector<View> views;
  for (const double degrees : {-50.0, -25.0, 0.0, 25.0, 50.0}) {
    const Vector3d around = AngleAxisd(degrees * M_PI / 180, up) * side;
    views.push_back(Looking(3.0 * around + 3.0 * up, Vector3d::Zero(), up));
  }
  // Their mean leans by 40 degrees; the level horizons determine the up vector.
  EXPECT_GT(UpVector(views).dot(up), std::cos(12.0 * M_PI / 180));
}

TEST(UpVectorTest, AveragesRollAndAcceptsOverheadViews) {
  const Vector3d up = -Vector3d::UnitY();
  const std::vector<View> rolled = {Looking({0, 0, -2}, Vector3d::Zero(), up, 0.2),
                                    Looking({0.1, 0, -2}, Vector3d::Zero(), up, -0.2)};
  EXPECT_GT(UpVector(rolled).dot(up), 0.998);
  std::vector<View> overhead;
  for (int i = 0; i < 4; ++i) {
    overhead.push_back(Looking({0.1, 0.1, 5.0}, {0.1, 0.1, 0.0}, Vector3d::UnitX(), i * M_PI / 2));
  }
  EXPECT_GT(UpVector(overhead).dot(Vector3d::UnitZ()), 0.999);
  EXPECT_EQ(UpVector({}), -Vector3d::UnitY());
}

TEST(ScenePlacementTest, KeyViewIsInFrontWithSamePicture) {
  Scene scene;
  const Vector3d up = Vector3d(0.1, -1.0, 0.2).normalized(), focus(1.0, 2.0, 3.0);
  scene.views = {Looking({5, 1, 0}, focus, up), Looking({4, 1, -4}, focus, up)};
  const ScenePlacement placement = PlaceScene(scene, 1, focus);
  EXPECT_LT(placement.Apply(focus).norm(), 1e-12);
  const PageCamera key = PlaceCamera(placement, scene.views[1]);
  EXPECT_NEAR(key.position.norm(), 2.0, 1e-12);
  EXPECT_NEAR(key.position.x(), 0.0, 1e-9);
  EXPECT_GT(key.position.z(), 0.0);
  EXPECT_LT(key.target.norm(), 1e-9);
  EXPECT_GT((placement.rotation * up).y(), 0.999);
  // A point has the same position relative to the camera in both worlds, up to scale and axes.
  const Vector3d point(1.5, 2.5, 2.0);
  for (const View& view : scene.views) {
    const PageCamera camera = PlaceCamera(placement, view);
    const Vector3d there =
        camera.rotation.conjugate() * (placement.Apply(point) - camera.position) / placement.scale;
    const Vector3d here = view.cam_from_world.Apply(point);
    EXPECT_LT((Vector3d(here.x(), -here.y(), -here.z()) - there).norm(), 1e-9);
  }
  EXPECT_THROW(PlaceScene(scene, 1, scene.views[1].cam_from_world.Center()), Error);
}

TEST(ScenePlacementTest, OverheadCameraHasUprightPicture) {
  Scene scene;
  scene.views = {Looking({0, -3, 0}, Vector3d::Zero(), Vector3d::UnitZ()),
                 Looking({0, 0, -3}, Vector3d::Zero(), -Vector3d::UnitY()),
                 Looking({3, 0, 0}, Vector3d::Zero(), -Vector3d::UnitY()),
                 Looking({-3, 0, 0}, Vector3d::Zero(), -Vector3d::UnitY())};
  const ScenePlacement placement = PlaceScene(scene, 0, Vector3d::Zero());
  EXPECT_NEAR(std::abs(placement.rotation.toRotationMatrix().determinant()), 1.0, 1e-12);
  EXPECT_GT(PlaceCamera(placement, scene.views[0]).position.y(), 1.8);
  // A point behind the camera is not a centre of orbit.
  View away = Looking({0, 0, -3}, {0, 0, -9}, -Vector3d::UnitY());
  EXPECT_GT((PlaceCamera(placement, away).target - PlaceCamera(placement, away).position).norm(),
            1.0);
}

}  // namespace
}  // namespace color3d
