#include "core/scene/masks/masked_points.h"

#include <algorithm>
#include <cstddef>
#include <memory>

namespace color3d {

std::vector<SparsePoint> UnmaskedPoints(const Scene& scene, const ViewImages& images) {
  std::vector<SparsePoint> points = scene.points;
  // By view, so that each mask is read once.
  for (int view = 0; view < static_cast<int>(scene.views.size()); ++view) {
    const std::shared_ptr<const Image> mask = images.Mask(view);
    if (mask == nullptr) continue;
    const Camera camera = images.WorkingCamera(view);
    for (SparsePoint& point : points) {
      const auto seen = std::ranges::lower_bound(point.views, view);
      if (seen == point.views.end() || *seen != view) continue;
      const Eigen::Vector3d p = scene.views[view].cam_from_world.Apply(point.position);
      if (!(p.z() > 0.0)) continue;
      const Eigen::Vector2d pixel = camera.Project(p);
      if (!camera.Contains(pixel)) continue;
      const float counts = mask->At(0, static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
      if (counts == 0.0f) point.views.erase(seen);
    }
  }
  std::vector<SparsePoint> kept;
  for (size_t i = 0; i < points.size(); ++i) {
    if (points[i].views.size() >= std::min<size_t>(2, scene.points[i].views.size())) {
      kept.push_back(std::move(points[i]));
    }
  }
  return kept;
}

}  // namespace color3d
