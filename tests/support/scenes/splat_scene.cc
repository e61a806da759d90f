#include "tests/support/scenes/splat_scene.h"

#include <cmath>

#include "core/base/random.h"

namespace color3d::testing_scene {
namespace {

// Three walls: x = -1, y = 1 (floor, y down) and z = 3. Returns the wall hit first.
int HitWall(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, Eigen::Vector3d* hit) {
  const double planes[3] = {-1.0, 1.0, 3.0};
  double nearest = 1e9;
  int wall = -1;
  for (int axis = 0; axis < 3; ++axis) {
    const double t = (planes[axis] - origin[axis]) / direction[axis];
    if (t > 1e-6 && t < nearest) {
      nearest = t;
      wall = axis;
    }
  }
  *hit = origin + nearest * direction;
  return wall;
}

// Smooth texture with a few edges.
void WallLab(int wall, const Eigen::Vector3d& p, float* lab) {
  const double u = p[(wall + 1) % 3], v = p[(wall + 2) % 3];
  const bool check =
      (static_cast<int>(std::floor(2.0 * u)) + static_cast<int>(std::floor(2.0 * v))) & 1;
  lab[0] = static_cast<float>(45.0 + 12.0 * std::sin(3.0 * u) + 8.0 * std::cos(4.0 * v) +
                              (check ? 18.0 : 0.0));
  const float a[3] = {40.0f, -30.0f, 5.0f}, b[3] = {20.0f, 30.0f, -40.0f};
  lab[1] = a[wall];
  lab[2] = b[wall];
}

View MakeView(int index, int views, int width, int height) {
  View view;
  view.name = "view_" + std::to_string(100 + index);
  view.camera = {width, height, 1.0 * width, 1.0 * width, 0.5 * width, 0.5 * height};
  view.captured_camera = view.camera;
  const double angle = views > 1 ? -0.35 + 0.7 * index / (views - 1) : 0.0;
  const Eigen::Vector3d center(0.8 * std::sin(angle) + 0.3, -0.2 + 0.1 * (index % 3), -0.5);
  const Eigen::Vector3d forward = (Eigen::Vector3d(-0.1, 0.3, 2.6) - center).normalized();
  const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(forward).normalized();
  Eigen::Matrix3d rotation;
  rotation.row(0) = right;
  rotation.row(1) = forward.cross(right);
  rotation.row(2) = forward;
  view.cam_from_world.rotation = Eigen::Quaterniond(rotation);
  view.cam_from_world.translation = -(rotation * center);
  return view;
}

Image CastRays(const View& view) {
  Image lab(view.camera.width, view.camera.height, 3);
  const Eigen::Vector3d origin = view.cam_from_world.Center();
  for (int y = 0; y < lab.height; ++y) {
    for (int x = 0; x < lab.width; ++x) {
      const Eigen::Vector3d ray = view.camera.Ray(x + 0.5, y + 0.5);
      Eigen::Vector3d hit;
      const int wall = HitWall(origin, view.cam_from_world.rotation.conjugate() * ray, &hit);
      float value[3];
      WallLab(wall, hit, value);
      for (int c = 0; c < 3; ++c) lab.At(c, y, x) = value[c];
    }
  }
  return lab;
}

}  // namespace

std::shared_ptr<const Image> ProceduralScene::Luminance(int view) const {
  auto l = std::make_shared<Image>(lab[view].width, lab[view].height, 1);
  std::copy_n(lab[view].Plane(0), l->PlaneSize(), l->data.data());
  return l;
}

Image ProceduralScene::Ab(int view) const {
  Image ab(lab[view].width, lab[view].height, 2);
  std::copy_n(lab[view].Plane(1), 2 * ab.PlaneSize(), ab.data.data());
  return ab;
}

ProceduralScene MakeRoomCorner(int views, int width, int height, int points) {
  ProceduralScene s;
  for (int i = 0; i < views; ++i) {
    s.scene.views.push_back(MakeView(i, views, width, height));
    s.lab.push_back(CastRays(s.scene.views.back()));
  }
  Random random(17);
  for (int i = 0; i < points; ++i) {
    const View& view = s.scene.views[i % views];
    const Eigen::Vector3d ray(
        random.NextUniform(-0.5, 0.5), random.NextUniform(-0.5, 0.5) * height / width, 1.0);
    SparsePoint point;
    HitWall(view.cam_from_world.Center(),
            view.cam_from_world.rotation.conjugate() * ray,
            &point.position);
    point.views = {i % views};
    s.scene.points.push_back(point);
  }
  return s;
}

}  // namespace color3d::testing_scene
