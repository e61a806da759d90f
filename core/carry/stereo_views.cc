#include "core/carry/stereo_views.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace color3d {
namespace {

constexpr double kBestAngleDegrees = 8.0;
constexpr double kAngleSpreadBelow = 4.0;
constexpr double kAngleSpreadAbove = 12.0;
// Quantiles of the surface's depth, and the factors that widen the range between them.
constexpr double kNearQuantile = 0.02, kFarQuantile = 0.98;
constexpr double kNearMargin = 0.75, kFarMargin = 1.6;

bool Sees(const View& view, const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = view.cam_from_world.Apply(point);
  return p.z() > 1e-6 && view.camera.Contains(view.camera.Project(p));
}

// Weight of the parallax between two directions, 0..1.
double AngleWeight(const Eigen::Vector3d& to_first, const Eigen::Vector3d& to_second) {
  const double cosine = to_first.normalized().dot(to_second.normalized());
  const double degrees = std::acos(std::clamp(cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
  const double spread = degrees < kBestAngleDegrees ? kAngleSpreadBelow : kAngleSpreadAbove;
  const double z = (degrees - kBestAngleDegrees) / spread;
  return std::exp(-0.5 * z * z);
}

}  // namespace

std::vector<std::vector<Eigen::Vector3d>> TrackedPoints(const Scene& scene) {
  std::vector<std::vector<Eigen::Vector3d>> tracked(scene.views.size());
  for (const SparsePoint& point : scene.points) {
    for (const int view : point.views) tracked[view].push_back(point.position);
  }
  return tracked;
}

StereoPlan PlanStereo(const Scene& scene,
                      int view,
                      const std::vector<Eigen::Vector3d>& surface,
                      const std::vector<int>& candidates,
                      int max_sources) {
  const View& reference = scene.views.at(view);
  StereoPlan plan;
  std::vector<double> depths;
  for (const Eigen::Vector3d& point : surface) {
    const double z = reference.cam_from_world.Apply(point).z();
    if (z > 1e-6) depths.push_back(z);
  }
  if (depths.empty()) return plan;
  std::sort(depths.begin(), depths.end());
  const auto quantile = [&](double q) {
    return depths[static_cast<size_t>(q * static_cast<double>(depths.size() - 1))];
  };
  plan.nearest = kNearMargin * quantile(kNearQuantile);
  plan.farthest = kFarMargin * quantile(kFarQuantile);
  std::vector<std::pair<double, int>> ranked;
  const Eigen::Vector3d center = reference.cam_from_world.Center();
  for (int other : candidates) {
    if (other == view) continue;
    const View& source = scene.views.at(other);
    const Eigen::Vector3d other_center = source.cam_from_world.Center();
    double score = 0.0;
    for (const Eigen::Vector3d& point : surface) {
      if (Sees(source, point)) score += AngleWeight(point - center, point - other_center);
    }
    if (score > 0.0) ranked.emplace_back(-score, other);
  }
  std::sort(ranked.begin(), ranked.end());
  for (const auto& [score, other] : ranked) {
    if (static_cast<int>(plan.sources.size()) == max_sources) break;
    plan.sources.push_back(other);
  }
  return plan;
}

}  // namespace color3d
