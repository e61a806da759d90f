#include "core/carry/dense_points.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <utility>

#include "core/base/evenly.h"
#include "core/carry/stereo_views.h"
#include "core/image/codec.h"
#include "core/scene/photo_masks.h"

namespace color3d {
namespace {

struct SweptView {
  Camera camera;
  Pose pose;
  Image luminance;           // of the size of the camera
  Image mask;                // of the same size; empty: nothing is masked
  std::vector<int> sources;  // views
  Image depth;               // empty when no other view overlaps
};

// Mask of a view, without its moving objects; empty: nothing is masked.
Image CombinedMask(int view,
                   const ViewImages& images,
                   const StillRegions& still,
                   const Camera& size) {
  Image both;
  for (const auto& mask : {images.Mask(view), still ? still(view) : nullptr}) {
    if (mask == nullptr) continue;
    Image reduced = ResizeMask(*mask, size.width, size.height);
    if (!both.Empty()) ClearMasked(&both, &reduced);
    both = std::move(reduced);
  }
  return both;
}

SweptView Reduced(const Scene& scene,
                  int view,
                  const ViewImages& images,
                  const StillRegions& still,
                  int side_px) {
  SweptView swept;
  swept.camera = images.WorkingCamera(view).FitWithin(side_px);
  swept.pose = scene.views[view].cam_from_world;
  swept.luminance = Resize(*images.Luminance(view), swept.camera.width, swept.camera.height);
  swept.mask = CombinedMask(view, images, still, swept.camera);
  return swept;
}

// Sweeps the depth of swept[view] against some of `candidates`.
void Sweep(const Scene& scene,
           int view,
           const std::vector<int>& candidates,
           const std::vector<Eigen::Vector3d>& tracked,
           const DensePointsOptions& options,
           const CancellationToken& cancel,
           std::vector<SweptView>& swept) {
  const StereoPlan plan = PlanStereo(scene, view, tracked, candidates, options.depth_sources);
  if (plan.sources.empty()) return;
  const auto posed = [&](int index) {
    const SweptView& v = swept[index];
    return PosedLuminance{v.camera, v.pose, &v.luminance, v.mask.Empty() ? nullptr : &v.mask};
  };
  std::vector<PosedLuminance> sources;
  for (const int index : plan.sources) sources.push_back(posed(index));
  swept[view].depth =
      SweepPlanes(posed(view), sources, plan.nearest, plan.farthest, options.sweep, cancel);
  ClearMasked(swept[view].mask.Empty() ? nullptr : &swept[view].mask, &swept[view].depth);
  swept[view].sources = plan.sources;
}

// Depth of the surface that `view` measures at `point`, relative to the depth of `point`, minus 1.
// NaN where it measures none.
double RelativeExcess(const SweptView& view, const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = view.pose.Apply(point);
  if (view.depth.data.empty() || !(p.z() > 0.0)) return std::nan("");
  const Eigen::Vector2d pixel = view.camera.Project(p);
  if (!view.camera.Contains(pixel)) return std::nan("");
  const double depth = view.depth.At(0, static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
  return depth > 0.0 ? depth / p.z() - 1.0 : std::nan("");
}

// Points of `view` that no earlier view has contributed.
std::vector<SparsePoint> ConfirmedPoints(const std::vector<SweptView>& swept,
                                         int view,
                                         const DensePointsOptions& options) {
  std::vector<SparsePoint> points;
  const SweptView& own = swept[view];
  if (own.depth.data.empty()) return points;
  const int needed = std::min<int>(options.agreeing, static_cast<int>(own.sources.size()));
  for (int y = 0; y < own.camera.height; ++y) {
    for (int x = 0; x < own.camera.width; ++x) {
      const double depth = own.depth.At(0, y, x);
      if (!(depth > 0.0)) continue;
      const Eigen::Vector3d ray = own.camera.Ray(x + 0.5, y + 0.5);
      const Eigen::Vector3d world = own.pose.WorldFromCamera(depth * ray);
      SparsePoint point;
      point.views = {view};
      double sum = 0.0;
      bool given = false;
      for (const int source : own.sources) {
        const double excess = RelativeExcess(swept[source], world);
        if (!(std::abs(excess) < options.tolerance)) continue;
        given = given || source < view;
        sum += excess;
        point.views.push_back(source);
      }
      if (given || static_cast<int>(point.views.size()) <= needed) continue;
      const double mean = sum / static_cast<double>(point.views.size());
      point.position = own.pose.WorldFromCamera(depth * (1.0 + mean) * ray);
      point.reprojection_error_px = -1.0;
      std::sort(point.views.begin(), point.views.end());
      points.push_back(std::move(point));
    }
  }
  return points;
}

struct SweepPlan {
  std::vector<int> views;                    // ascending
  std::vector<std::vector<int>> candidates;  // views to compare with, by view of the scene
};

// All views of some times, evenly spread. Evenly spread views when there is one time, or one view
// of each.
SweepPlan PlanSweeps(const Scene& scene, size_t most) {
  const std::vector<int> training = scene.TrainingViews();
  std::map<double, std::vector<int>> by_time;
  for (const int view : training) by_time[scene.views[view].time_s()].push_back(view);
  SweepPlan plan;
  plan.candidates.resize(scene.views.size());
  if (by_time.size() == 1 || by_time.size() == training.size()) {
    plan.views = PickEvenly(training, most);
    for (const int view : plan.views) plan.candidates[view] = plan.views;
    return plan;
  }
  const size_t few = std::max<size_t>(1, most * by_time.size() / training.size());
  std::vector<std::vector<int>> groups;
  for (auto& [time, views] : by_time) groups.push_back(std::move(views));
  groups = PickEvenly(std::move(groups), few);
  for (std::vector<int>& views : groups) {
    views = PickEvenly(std::move(views), most);
    plan.views.insert(plan.views.end(), views.begin(), views.end());
  }
  std::sort(plan.views.begin(), plan.views.end());
  for (const std::vector<int>& views : groups) {
    for (const int view : views) plan.candidates[view] = views.size() > 1 ? views : plan.views;
  }
  return plan;
}

}  // namespace

std::vector<SparsePoint> DensePoints(const Scene& scene,
                                     const ViewImages& images,
                                     const DensePointsOptions& options,
                                     const RunControl& run,
                                     const StillRegions& still) {
  const std::vector<std::vector<Eigen::Vector3d>> tracked = TrackedPoints(scene);
  const SweepPlan plan = PlanSweeps(scene, options.max_views);
  std::vector<SweptView> swept(scene.views.size());
  const auto for_each_view = [&](const std::function<void(int view)>& work) {
    run.pool.ForEach(static_cast<int64_t>(plan.views.size()), [&](int64_t k, int) {
      run.cancel.ThrowIfCancelled();
      work(plan.views[k]);
    });
  };
  for_each_view(
      [&](int view) { swept[view] = Reduced(scene, view, images, still, options.depth_side_px); });
  for_each_view([&](int view) {
    Sweep(scene, view, plan.candidates[view], tracked[view], options, run.cancel, swept);
  });
  std::vector<std::vector<SparsePoint>> by_view(scene.views.size());
  for_each_view([&](int view) { by_view[view] = ConfirmedPoints(swept, view, options); });
  std::vector<SparsePoint> all;
  for (std::vector<SparsePoint>& points : by_view) {
    std::move(points.begin(), points.end(), std::back_inserter(all));
  }
  return PickEvenly(std::move(all), options.max_points);
}

}  // namespace color3d
