#include "core/carry/carry_views.h"

#include <utility>

#include "core/carry/stereo_views.h"
#include "core/image/codec.h"
#include "core/scene/photo_masks.h"

namespace color3d {
namespace {

constexpr float kMinOpacity = 0.5f;    // minimum opacity for a valid depth
constexpr size_t kEnoughTracked = 30;  // number of tracked points of a view that suffices
constexpr int kSurfaceGridPx = 16;     // spacing of the rendered depths that replace them

}  // namespace

SurfaceMaker::SurfaceMaker(const Scene& scene,
                           const ViewImages& images,
                           const ViewImages& sweep_images,
                           SurfaceRenderer render,
                           int depth_sources,
                           const PlaneSweepOptions& sweep,
                           const CancellationToken& cancel)
    : scene_(scene),
      images_(images),
      sweep_images_(sweep_images),
      render_(std::move(render)),
      depth_sources_(depth_sources),
      sweep_(sweep),
      cancel_(cancel),
      training_(scene.TrainingViews()),
      tracked_(TrackedPoints(scene)) {}

ViewSurfaces SurfaceMaker::Make(int view) const {
  const Pose& pose = scene_.views[view].cam_from_world;
  const Camera camera = images_.WorkingCamera(view);
  RenderedSurface surface = render_(view, camera);
  for (size_t i = 0; i < surface.depth.data.size(); ++i) {
    if (surface.opacity.data[i] < kMinOpacity) surface.depth.data[i] = 0.0f;
  }
  // Masked pixels have no surface, so that nothing is carried to or from them.
  ClearMasked(images_.Mask(view).get(), &surface.depth);
  ViewSurfaces surfaces;
  surfaces.rendered = {camera, pose, *images_.Luminance(view), std::move(surface.depth)};
  surfaces.swept = Sweep(view, surfaces.rendered);
  return surfaces;
}

std::optional<SurfaceView> SurfaceMaker::Sweep(int view, const SurfaceView& rendered) const {
  const StereoPlan plan = PlanStereo(
      scene_, view, SurfacePoints(view, rendered), TrainingViewsOfTime(view), depth_sources_);
  if (plan.sources.empty()) return std::nullopt;
  std::vector<std::shared_ptr<const Image>> pictures, masks;  // keeps them alive
  const auto posed = [&](int index) {
    pictures.push_back(sweep_images_.Luminance(index));
    masks.push_back(sweep_images_.Mask(index));
    return PosedLuminance{sweep_images_.WorkingCamera(index),
                          scene_.views[index].cam_from_world,
                          pictures.back().get(),
                          masks.back().get()};
  };
  std::vector<PosedLuminance> sources;
  for (int index : plan.sources) sources.push_back(posed(index));
  SurfaceView swept = rendered;
  swept.depth =
      Resize(SweepPlanes(posed(view), sources, plan.nearest, plan.farthest, sweep_, cancel_),
             rendered.camera.width,
             rendered.camera.height);
  ClearMasked(images_.Mask(view).get(), &swept.depth);
  return swept;
}

// Training views of the same time; all of them in static scenes.
std::vector<int> SurfaceMaker::TrainingViewsOfTime(int view) const {
  std::vector<int> same;
  for (const int other : training_) {
    if (scene_.views[other].time_s() == scene_.views[view].time_s()) same.push_back(other);
  }
  return same;
}

// Points visible in the view: tracked ones if there are enough, else of the rendered surface.
std::vector<Eigen::Vector3d> SurfaceMaker::SurfacePoints(int view,
                                                         const SurfaceView& rendered) const {
  if (tracked_[view].size() >= kEnoughTracked) return tracked_[view];
  std::vector<Eigen::Vector3d> points;
  const Camera& camera = rendered.camera;
  for (int y = kSurfaceGridPx / 2; y < camera.height; y += kSurfaceGridPx) {
    for (int x = kSurfaceGridPx / 2; x < camera.width; x += kSurfaceGridPx) {
      const double depth = rendered.depth.At(0, y, x);
      if (!(depth > 0.0)) continue;
      points.push_back(
          rendered.cam_from_world.WorldFromCamera(depth * camera.Ray(x + 0.5, y + 0.5)));
    }
  }
  return points;
}

CarriedColor CarryFromAll(const std::vector<ColoredKeyView>& keys,
                          const ViewSurfaces& target,
                          const CarryOptions& options) {
  const Camera& camera = target.rendered.camera;
  const int channels = keys.empty() ? 2 : keys.front().color.ab.channels;
  CarriedColor all{Image(camera.width, camera.height, channels),
                   Image(camera.width, camera.height, 1)};
  for (const ColoredKeyView& key : keys) {
    const auto carry = [&](const SurfaceView& from, const SurfaceView& to) {
      return CarryColor(from, key.color.ab, key.color.confidence, to, options);
    };
    CarriedColor carried = carry(key.surfaces.rendered, target.rendered);
    if (key.surfaces.swept && target.swept) {
      KeepMoreConfident(carry(*key.surfaces.swept, *target.swept), &carried);
    }
    FillFrom(carried, &all);
  }
  return all;
}

}  // namespace color3d
