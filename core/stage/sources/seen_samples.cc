#include "core/stage/sources/seen_samples.h"

#include <algorithm>
#include <cmath>

#include "core/stage/sources/render_view.h"

namespace color3d {
namespace {

constexpr int kColumns = 16, kRows = 12;
constexpr int kDepthSidePx = 128;
constexpr float kMinOpacity = 0.5f;
constexpr double kDepthTolerance = 0.06;  // relative; coarse, as the depth maps are

struct Surface {
  Camera camera;
  Pose pose;
  Image depth;  // 0: no surface
};

bool Shows(const Surface& view, const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = view.pose.Apply(point);
  if (!(p.z() > 1e-6)) return false;
  const Eigen::Vector2d pixel = view.camera.Project(p);
  if (!view.camera.Contains(pixel)) return false;
  // One agreeing neighbour is enough: edges are a blend of two depths.
  for (int dy = -1; dy <= 0; ++dy) {
    for (int dx = -1; dx <= 0; ++dx) {
      const int x = std::clamp(static_cast<int>(pixel.x() + 0.5) + dx, 0, view.camera.width - 1);
      const int y = std::clamp(static_cast<int>(pixel.y() + 0.5) + dy, 0, view.camera.height - 1);
      const double depth = view.depth.At(0, y, x);
      if (depth > 0.0 && std::abs(depth - p.z()) < kDepthTolerance * p.z()) return true;
    }
  }
  return false;
}

}  // namespace

SampleGrid GridFor(int views) {
  const int samples = SeenSamples::SamplesFor(views, kColumns * kRows);
  const int rows = std::max(1, static_cast<int>(std::sqrt(0.75 * samples)));
  return {samples / rows, rows};
}

SeenSamples SeenByGeometry(const Scene& scene,
                           const std::vector<int>& views,
                           const GaussianModel& geometry,
                           const SampleGrid& grid,
                           ThreadPool& pool,
                           const CancellationToken& cancel) {
  const int count = static_cast<int>(views.size());
  std::vector<Surface> surfaces;
  for (const int view : views) {
    cancel.ThrowIfCancelled();
    const Camera camera = scene.views[view].camera.FitWithin(kDepthSidePx);
    const Pose& pose = scene.views[view].cam_from_world;
    RenderedView rendered = RenderView(geometry, scene.views[view], camera, pool);
    for (size_t i = 0; i < rendered.depth.data.size(); ++i) {
      if (rendered.opacity.data[i] < kMinOpacity) rendered.depth.data[i] = 0.0f;
    }
    surfaces.push_back({camera, pose, std::move(rendered.depth)});
  }
  SeenSamples seen(count, grid.samples());
  for (int view = 0; view < count; ++view) {
    const Surface& from = surfaces[view];
    for (int s = 0; s < grid.samples(); ++s) {
      const double x = grid.X(s) * from.camera.width, y = grid.Y(s) * from.camera.height;
      const double depth = from.depth.At(0,
                                         std::min(static_cast<int>(y), from.camera.height - 1),
                                         std::min(static_cast<int>(x), from.camera.width - 1));
      if (!(depth > 0.0)) continue;
      const Eigen::Vector3d point = from.pose.WorldFromCamera(depth * from.camera.Ray(x, y));
      for (int by = 0; by < count; ++by) {
        if (by == view || Shows(surfaces[by], point)) seen.SetSeen(by, view, s);
      }
    }
  }
  return seen;
}

std::filesystem::path FeatureCache(const StageContext& context) {
  const std::filesystem::path& folder = context.cache_folder();
  return folder.empty() ? folder : folder / "view_features";
}

SeenSamples SeenByPoints(const Scene& scene, const std::vector<int>& views) {
  std::vector<int> index_of(scene.views.size(), -1);
  for (size_t k = 0; k < views.size(); ++k) index_of[views[k]] = static_cast<int>(k);
  std::vector<std::vector<const SparsePoint*>> points(views.size());
  size_t most = 0;
  for (const SparsePoint& point : scene.points) {
    for (const int view : point.views) {
      if (index_of[view] < 0) continue;
      points[index_of[view]].push_back(&point);
      most = std::max(most, points[index_of[view]].size());
    }
  }
  const int count = static_cast<int>(views.size());
  if (most == 0) return SeenSamples(count, 0);
  SeenSamples seen(count, SeenSamples::SamplesFor(count, kColumns * kRows));
  for (int view = 0; view < count; ++view) {
    const auto& own = points[view];
    for (int s = 0; s < seen.samples() && !own.empty(); ++s) {
      const SparsePoint& point = *own[static_cast<size_t>(s) * own.size() / seen.samples()];
      for (const int by : point.views) {
        if (index_of[by] >= 0) seen.SetSeen(index_of[by], view, s);
      }
    }
  }
  return seen;
}

}  // namespace color3d
