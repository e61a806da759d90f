#include "core/augment/orbit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace color3d {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kMinAngle = 3.0 * kDegree;
constexpr double kMaxAngle = 12.0 * kDegree;
constexpr double kDepthRange = 3.0;
// Minimum ratio of the eigenvalues of the normal equations; below, the axes count as parallel.
constexpr double kMinConditioning = 1e-3;

Eigen::Vector3d OpticalAxis(const Pose& pose) {
  return pose.rotation.conjugate() * Eigen::Vector3d::UnitZ();
}

}  // namespace

Eigen::Vector3d CenterOfAttention(const Scene& scene, int key, double key_depth) {
  const Pose& pose = scene.views.at(static_cast<size_t>(key)).cam_from_world;
  const Eigen::Vector3d on_axis = pose.Center() + key_depth * OpticalAxis(pose);
  // Least squares: sum over the views of (I - d d^T) (x - c) = 0.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const int view : scene.TrainingViews()) {
    const Pose& other = scene.views[static_cast<size_t>(view)].cam_from_world;
    const Eigen::Vector3d axis = OpticalAxis(other);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    normal += across;
    right += across * other.Center();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(normal, Eigen::EigenvaluesOnly);
  if (!(eigen.eigenvalues()(0) > kMinConditioning * eigen.eigenvalues()(2))) return on_axis;
  const Eigen::Vector3d nearest = normal.ldlt().solve(right);
  const double depth = pose.Apply(nearest).z();
  const bool plausible =
      nearest.allFinite() && depth > key_depth / kDepthRange && depth < key_depth * kDepthRange;
  return plausible ? nearest : on_axis;
}

double OrbitAngle(const Scene& scene, int key, const Eigen::Vector3d& center) {
  const Eigen::Vector3d to_key =
      (scene.views.at(static_cast<size_t>(key)).cam_from_world.Center() - center).normalized();
  std::vector<double> angles;
  for (const int view : scene.TrainingViews()) {
    if (view == key) continue;
    const Eigen::Vector3d to_view =
        (scene.views[static_cast<size_t>(view)].cam_from_world.Center() - center).normalized();
    const double angle = std::acos(std::clamp(to_key.dot(to_view), -1.0, 1.0));
    if (std::isfinite(angle)) angles.push_back(angle);
  }
  if (angles.empty()) return kMinAngle;
  const auto middle = angles.begin() + static_cast<std::ptrdiff_t>(angles.size() / 2);
  std::nth_element(angles.begin(), middle, angles.end());
  return std::clamp(*middle, kMinAngle, kMaxAngle);
}

Pose OrbitPose(const Pose& cam_from_world,
               const Eigen::Vector3d& center,
               double azimuth,
               double elevation) {
  // In the camera's frame (x right, y down) the scene turns the other way.
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(elevation, Eigen::Vector3d::UnitX()) *
                                  Eigen::AngleAxisd(azimuth, Eigen::Vector3d::UnitY());
  const Eigen::Vector3d pivot = cam_from_world.Apply(center);
  Pose pose;
  pose.rotation = (turn * cam_from_world.rotation).normalized();
  pose.translation = turn * (cam_from_world.translation - pivot) + pivot;
  return pose;
}

}  // namespace color3d
