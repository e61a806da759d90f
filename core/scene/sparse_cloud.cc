#include "core/scene/sparse_cloud.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/evenly.h"
#include "core/base/random.h"

namespace color3d {
namespace {

constexpr size_t kMaxListedViews = 64;

Eigen::Vector3d ViewingDirection(const View& view) {
  return view.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
}

Eigen::Vector3d MeanCenter(const Scene& scene) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const View& view : scene.views) mean += view.cam_from_world.Center();
  return mean / static_cast<double>(scene.views.size());
}

// Largest distance of a camera from their mean; 1 if all are in one place.
double Baseline(const Scene& scene, const Eigen::Vector3d& mean) {
  double radius = 0.0;
  for (const View& view : scene.views) {
    radius = std::max(radius, (view.cam_from_world.Center() - mean).norm());
  }
  return radius > 1e-12 ? radius : 1.0;
}

bool IsVisible(const View& view, const Eigen::Vector3d& world, double near) {
  const Eigen::Vector3d p = view.cam_from_world.Apply(world);
  if (p.z() <= 0.0 || p.z() < near) return false;
  return view.camera.Contains(view.camera.Project(p));
}

std::vector<int> AllViewsFacing(const Scene& scene, const Eigen::Vector3d& world, double near) {
  std::vector<int> views;
  for (size_t i = 0; i < scene.views.size(); ++i) {
    if (IsVisible(scene.views[i], world, near)) views.push_back(static_cast<int>(i));
  }
  return views;
}

bool IsInFrontOfMostViews(const Scene& scene, const Eigen::Vector3d& world) {
  size_t in_front = 0;
  for (const View& view : scene.views) in_front += view.cam_from_world.Apply(world).z() > 0.0;
  return 2 * in_front > scene.views.size();
}

// Range of depths at which other views may overlap with a view.
struct DepthRange {
  double near = 0.0;
  double far = 0.0;
};

// Range around the point where the axes meet. Measured on three scenes without their points
// (held-out luminance after 800 iterations at 252 px): 0.4 to 1.4 dB better than a box around the
// focus, which is better than a range of 0.3..4, whose nearest points hide all others.
DepthRange PlausibleDepths(const View& view, const Eigen::Vector3d& focus, double distance) {
  const double depth = std::max(view.cam_from_world.Apply(focus).z(), distance);
  return {0.6 * depth, 2.0 * depth};
}

}  // namespace

Eigen::Vector3d FocusPoint(const Scene& scene) {
  const Eigen::Vector3d mean = MeanCenter(scene);
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  for (const View& view : scene.views) direction += ViewingDirection(view);
  const double coherence = direction.norm() / static_cast<double>(scene.views.size());
  const Eigen::Vector3d fallback =
      coherence > 1e-3
          ? Eigen::Vector3d(mean + 3.0 * Baseline(scene, mean) * direction.normalized())
          : mean;
  // Least squares: minimise sum |(I - d d^T)(x - c)|^2 + w |x - fallback|^2.
  constexpr double kPull = 1e-3;
  Eigen::Matrix3d a = kPull * Eigen::Matrix3d::Identity();
  Eigen::Vector3d b = kPull * fallback;
  for (const View& view : scene.views) {
    const Eigen::Vector3d d = ViewingDirection(view);
    const Eigen::Matrix3d normal =
        (Eigen::Matrix3d::Identity() - d * d.transpose()) / static_cast<double>(scene.views.size());
    a += normal;
    b += normal * view.cam_from_world.Center();
  }
  const Eigen::Vector3d focus = a.ldlt().solve(b);
  // Diverging axes meet behind the cameras; that point is useless.
  return IsInFrontOfMostViews(scene, focus) ? focus : fallback;
}

std::vector<int> ViewsFacing(const Scene& scene, const Eigen::Vector3d& world, double near) {
  return PickEvenly(AllViewsFacing(scene, world, near), kMaxListedViews);
}

std::vector<SparsePoint> RandomPoints(const Scene& scene, int count, uint64_t seed) {
  std::vector<SparsePoint> points;
  if (scene.views.empty() || count <= 0) return points;
  const Eigen::Vector3d focus = FocusPoint(scene);
  const Eigen::Vector3d mean = MeanCenter(scene);
  double distance = 0.0;
  for (const View& view : scene.views) distance += (view.cam_from_world.Center() - focus).norm();
  distance /= static_cast<double>(scene.views.size());
  // Cameras look outward from one place: the scene is around them.
  if (!IsInFrontOfMostViews(scene, focus))
    distance = std::max(distance, 5.0 * Baseline(scene, mean));
  const double near = 0.15 * distance;
  const size_t wanted_views = std::max<size_t>(2, (scene.views.size() + 3) / 4);
  // Views without any overlap would never give a point: after enough misses one view is enough.
  const int64_t patience = int64_t{10} * count;
  Random random(seed);
  for (int64_t attempt = 0; attempt < 2 * patience; ++attempt) {
    if (static_cast<int>(points.size()) == count) break;
    // Picks pixels of all views in turn, at a depth uniform in 1 / z, as parallax is.
    const View& view = scene.views[attempt % static_cast<int64_t>(scene.views.size())];
    const DepthRange range = PlausibleDepths(view, focus, 0.3 * distance);
    const double z = 1.0 / random.NextUniform(1.0 / range.far, 1.0 / range.near);
    const double u = random.NextUniform(0.0, view.camera.width);
    const double v = random.NextUniform(0.0, view.camera.height);
    SparsePoint point;
    point.position = view.cam_from_world.WorldFromCamera(z * view.camera.Ray(u, v));
    point.views = AllViewsFacing(scene, point.position, near);
    const bool relaxed = attempt >= patience;
    if (point.views.size() < (relaxed ? 1 : std::min(wanted_views, scene.views.size()))) continue;
    point.views = PickEvenly(std::move(point.views), kMaxListedViews);
    point.reprojection_error_px = -1.0;
    points.push_back(std::move(point));
  }
  return points;
}

}  // namespace color3d
