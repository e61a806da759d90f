#include "tests/support/scenes/solid.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

namespace color3d {
namespace {
using Eigen::Vector3d;

Solid Make(Solid::Shape shape) {
  Solid solid(shape, {0.2, -0.1, 0.4}, {0.6, 0.4, 0.1}, 30.0, {});
  solid.wave_m = 0.8;
  solid.phase = 0.7;
  return solid;
}

TEST(Solid, RaysHitASheetFromBothSides) {
  const Solid sheet = Make(Solid::Shape::kSheet);
  int met = 0;
  for (const double from : {-3.0, 3.0}) {
    for (int i = 0; i < 400; ++i) {
      const Vector3d origin(0.2, -0.1, 0.4 + from);
      const Vector3d direction(
          0.012 * (i % 20 - 10), 0.008 * (i / 20 - 10), from < 0.0 ? 1.0 : -1.0);
      Hit hit;
      if (!sheet.Intersect(origin, direction, &hit)) continue;
      EXPECT_FALSE(sheet.Misses(origin, direction));
      const Vector3d at = origin + hit.distance * direction;
      const Vector3d local = sheet.ToLocal(at - sheet.center);
      EXPECT_LT((sheet.InWorld(sheet.OnMaterial(at)) - at).norm(), 1e-9);
      EXPECT_LE(std::abs(local.x()), 0.6 + 1e-9);
      EXPECT_NEAR(hit.normal.norm(), 1.0, 1e-12);
      EXPECT_LT(hit.normal.dot(direction), 0.0);
      ++met;
    }
  }
  EXPECT_GT(met, 500);
}

// Normal of the intersected surface, by finite differences.
TEST(Solid, NormalsArePerpendicular) {
  for (const auto shape : {Solid::Shape::kBox, Solid::Shape::kEllipsoid, Solid::Shape::kSheet}) {
    const Solid solid = Make(shape);
    const Vector3d origin(0.1, 0.0, -3.0), direction(0.01, 0.005, 1.0);
    const double step = 1e-5;
    Hit hit, right, down;
    ASSERT_TRUE(solid.Intersect(origin, direction, &hit));
    ASSERT_TRUE(solid.Intersect(origin, direction + Vector3d(step, 0, 0), &right));
    ASSERT_TRUE(solid.Intersect(origin, direction + Vector3d(0, step, 0), &down));
    const Vector3d at = hit.distance * direction;
    const Vector3d u = right.distance * (direction + Vector3d(step, 0, 0)) - at;
    const Vector3d v = down.distance * (direction + Vector3d(0, step, 0)) - at;
    EXPECT_NEAR(std::abs(u.cross(v).normalized().dot(hit.normal)), 1.0, 1e-4);
  }
}

TEST(Solid, MaterialPointsMoveWithTheirSolid) {
  Solid solid = Make(Solid::Shape::kBox);
  const Vector3d corner = solid.OnMaterial(solid.InWorld({0.6, 0.4, 0.1}));
  EXPECT_LT((corner - Vector3d(0.6, 0.4, 0.1)).norm(), 1e-12);
  const Vector3d before = solid.InWorld(corner);
  solid.SetYaw(120.0);
  const Vector3d after = solid.InWorld(corner);
  EXPECT_NEAR((before - solid.center).norm(), (after - solid.center).norm(), 1e-12);
  // A quarter turn about y.
  EXPECT_NEAR((before - after).norm(), std::sqrt(2.0) * std::hypot(0.6, 0.1), 1e-9);
}

}  // namespace
}  // namespace color3d
