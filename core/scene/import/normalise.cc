#include "core/scene/import/normalise.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/scene/sparse_cloud.h"

namespace color3d {
namespace {

constexpr double kMinDepth = 1.0;
constexpr double kMaxDepth = 1000.0;
constexpr double kStandardDepth = 10.0;
constexpr double kFarFromOrigin = 1e3;
constexpr double kOutOfReach = 1e9;  // typical depths

std::string Short(double value) { return fmt::format("{:.3g}", value); }

Eigen::Vector3d MeanCenter(const Scene& scene) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const View& view : scene.views) {
    mean += view.cam_from_world.Center() / static_cast<double>(scene.views.size());
  }
  return mean;
}

void CheckWithinReach(const Scene& scene, const Eigen::Vector3d& mean, double depth) {
  const auto check = [&](const Eigen::Vector3d& position, const std::string& what) {
    if ((position - mean).cwiseAbs().maxCoeff() <= kOutOfReach * depth) return;
    throw InvalidArgument(
        "{} lies {} units away from the cameras, which see things {} units away; remove it or "
        "correct it",
        what,
        Short((position - mean).norm()),
        Short(depth));
  };
  for (const View& view : scene.views) {
    check(view.cam_from_world.Center(), "the camera of " + view.name);
  }
  for (size_t i = 0; i < scene.points.size(); ++i) {
    check(scene.points[i].position, fmt::format("sparse point {}", i));
  }
}

// Largest coordinate of cameras and points.
double LargestCoordinate(const Scene& scene) {
  double largest = 0.0;
  for (const View& view : scene.views) {
    largest = std::max(largest, view.cam_from_world.Center().cwiseAbs().maxCoeff());
  }
  for (const SparsePoint& point : scene.points) {
    largest = std::max(largest, point.position.cwiseAbs().maxCoeff());
  }
  return largest;
}

// From x to x' with x = scale x' + offset.
void Transform(double scale, const Eigen::Vector3d& offset, Scene* scene) {
  for (View& view : scene->views) {
    Pose& pose = view.cam_from_world;
    pose.translation = (pose.translation + pose.rotation * offset) / scale;
  }
  for (SparsePoint& point : scene->points) point.position = (point.position - offset) / scale;
  scene->world_offset += scene->world_from_scene_scale * offset;
  scene->world_from_scene_scale *= scale;
}

}  // namespace

double ShareBehindCameras(const Scene& scene) {
  size_t behind = 0, all = 0;
  for (const SparsePoint& point : scene.points) {
    for (const int view : point.views) {
      ++all;
      behind += !(scene.views[view].cam_from_world.Apply(point.position).z() > 0.0);
    }
  }
  return all == 0 ? 0.0 : static_cast<double>(behind) / static_cast<double>(all);
}

double TypicalDepth(const Scene& scene) {
  if (scene.points.empty()) {
    const Eigen::Vector3d focus = FocusPoint(scene);
    double sum = 0.0;
    for (const View& view : scene.views) sum += (view.cam_from_world.Center() - focus).norm();
    return sum / static_cast<double>(std::max<size_t>(1, scene.views.size()));
  }
  std::vector<double> depths;
  for (const SparsePoint& point : scene.points) {
    for (const int view : point.views) {
      const double depth = scene.views[view].cam_from_world.Apply(point.position).z();
      if (depth > 0.0) depths.push_back(depth);
    }
  }
  if (depths.empty()) {
    throw InvalidArgument(
        "all {} sparse points lie behind the cameras that observe them; poses must be "
        "world-to-camera with z forward (COLMAP's convention)",
        scene.points.size());
  }
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return *middle;
}

std::vector<std::string> NormaliseScene(Scene* scene) {
  const double depth = TypicalDepth(*scene);
  const Eigen::Vector3d mean = MeanCenter(*scene);
  if (!std::isfinite(depth) || !mean.allFinite()) {
    throw InvalidArgument("the scene's coordinates are too large; scale its poses down");
  }
  CheckWithinReach(*scene, mean, std::max(depth, 1e-300));
  std::vector<std::string> notes;
  // Cameras with one position and direction have no scale.
  const bool in_band = !(depth > 0.0) || (depth >= kMinDepth && depth <= kMaxDepth);
  const double scale = in_band ? 1.0 : depth / kStandardDepth;
  const bool far = LargestCoordinate(*scene) / scale > kFarFromOrigin &&
                   mean.cwiseAbs().maxCoeff() / scale > kFarFromOrigin;
  if (in_band && !far) return notes;
  Transform(scale, far ? mean : Eigen::Vector3d(Eigen::Vector3d::Zero()), scene);
  if (far) {
    notes.push_back(
        "the scene lies far from the origin; its coordinates are kept relative to the cameras' "
        "mean and put back on export");
  }
  if (!in_band) {
    notes.push_back("the cameras see things " + Short(depth) +
                    " units away; lengths are kept divided by " + Short(scale) +
                    " and put back on export");
  }
  return notes;
}

}  // namespace color3d
