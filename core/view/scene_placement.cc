#include "core/view/scene_placement.h"

#include <cmath>

#include "core/base/error.h"

namespace color3d {
namespace {

using Eigen::Vector3d;

constexpr double kKeyDistance = 2.0;   // of the key view's camera, in the page's units
constexpr double kTiltWeight = 0.1;    // of the mean up vector against level horizons
constexpr double kOneDirection = 0.3;  // length of a mean of unit vectors that agree a little

// An axis of the camera, in the scene's frame.
Vector3d AxisOf(const View& view, const Vector3d& in_camera) {
  return view.cam_from_world.rotation.conjugate() * in_camera;
}

}  // namespace

Vector3d UpVector(const std::vector<View>& views) {
  Vector3d up = Vector3d::Zero(), against_look = Vector3d::Zero();
  Eigen::Matrix3d rights = Eigen::Matrix3d::Zero();
  for (const View& view : views) {
    up -= AxisOf(view, Vector3d::UnitY());
    against_look -= AxisOf(view, Vector3d::UnitZ());
    const Vector3d right = AxisOf(view, Vector3d::UnitX());
    rights += right * right.transpose();
  }
  const double count = static_cast<double>(views.size());
  if (up.norm() < kOneDirection * count) {
    return against_look.norm() < kOneDirection * count ? Vector3d(-Vector3d::UnitY())
                                                       : against_look.normalized();
  }
  if (views.empty()) return -Vector3d::UnitY();
  // min over u of sum (right . u)^2 + w n |u - mean|^2.
  const Eigen::Matrix3d level = rights + kTiltWeight * count * Eigen::Matrix3d::Identity();
  return level.ldlt().solve(kTiltWeight * up).normalized();
}

ScenePlacement PlaceScene(const Scene& scene, int key_view, const Vector3d& focus) {
  const View& key = scene.views.at(key_view);
  const double distance = (focus - key.cam_from_world.Center()).norm();
  if (!(distance > 0.0) || !std::isfinite(distance)) {
    throw InvalidArgument("the focus of the key view {} is at its camera; choose another key view",
                          key.name);
  }
  const Vector3d y = UpVector(scene.views);
  // +z towards the key view's camera, level; from straight above: the lower edge of its picture.
  const auto level = [&y](const Vector3d& v) { return Vector3d(v - v.dot(y) * y); };
  Vector3d z = level(-AxisOf(key, Vector3d::UnitZ()));
  if (z.norm() < 1e-3) z = level(AxisOf(key, Vector3d::UnitY()));
  if (z.norm() < 1e-3) z = y.unitOrthogonal();
  z.normalize();
  Eigen::Matrix3d rows;
  rows << y.cross(z).transpose(), y.transpose(), z.transpose();
  return {Eigen::Quaterniond(rows), focus, kKeyDistance / distance};
}

PageCamera PlaceCamera(const ScenePlacement& placement, const View& view) {
  PageCamera camera;
  camera.position = placement.Apply(view.cam_from_world.Center());
  const Eigen::Quaterniond flip(0.0, 1.0, 0.0, 0.0);  // y down, z forward -> y up, z back
  camera.rotation = placement.rotation * view.cam_from_world.rotation.conjugate() * flip;
  const Vector3d look = placement.rotation * AxisOf(view, Vector3d::UnitZ());
  const double ahead = -camera.position.dot(look);
  // Points behind a camera or very close to it are unsuitable as centre.
  const double least = 0.2 * kKeyDistance;
  camera.target = camera.position + (ahead > least ? ahead : kKeyDistance) * look;
  return camera;
}

}  // namespace color3d
