#include <algorithm>
#include <optional>

#include "core/base/range_check.h"
#include "core/carry/stereo_views.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/splat/raster/render.h"
#include "core/stage/artifacts.h"
#include "core/stage/carried_views.h"
#include "core/stage/carry_facts.h"
#include "core/stage/key_color_sources.h"
#include "core/stage/next_key_view.h"
#include "core/stage/stages.h"

namespace color3d {
namespace {

constexpr float kCovered = 0.25f;        // confidence from which a pixel counts as covered
constexpr double kSmallCoverage = 0.01;  // below, the user is told
constexpr float kLeastOpacity = 0.5f;    // of the Gaussians, for a depth to count
constexpr size_t kLeastTracked = 30;     // points of structure-from-motion that suffice
constexpr int kSurfaceGridPx = 16;       // else: one rendered depth per so many px

// Two opinions on where the surfaces of a view are: from the Gaussians, and from comparing
// photographs. The latter may be missing (no other view shows the same).
struct ViewSurfaces {
  SurfaceView gaussians;
  std::optional<SurfaceView> swept;
};

class SurfaceMaker {
 public:
  SurfaceMaker(const Scene& scene,
               const GaussianModel& geometry,
               const CarryColorOptions& options,
               const StageContext& context)
      : scene_(scene),
        geometry_(geometry),
        options_(options),
        cancel_(context.cancel()),
        images_(scene, context.scene_folder(), options.max_side_px),
        small_(scene, context.scene_folder(), options.depth_side_px),
        training_(scene.TrainingViews()),
        tracked_(scene.views.size()) {
    for (const SparsePoint& point : scene.points) {
      for (int view : point.views) tracked_[view].push_back(point.position);
    }
  }

  const ViewImages& images() const { return images_; }

  // Thread-safe.
  ViewSurfaces Make(int view) const {
    const View& v = scene_.views[view];
    ThreadPool one(1);
    const Camera camera = images_.WorkingCamera(view);
    RenderedView rendered = RenderView(geometry_, camera, v.cam_from_world, one);
    for (size_t i = 0; i < rendered.depth.data.size(); ++i) {
      if (rendered.opacity.data[i] < kLeastOpacity) rendered.depth.data[i] = 0.0f;
    }
    ViewSurfaces surfaces;
    surfaces.gaussians = {
        camera, v.cam_from_world, *images_.Luminance(view), std::move(rendered.depth)};
    surfaces.swept = Sweep(view, surfaces.gaussians);
    return surfaces;
  }

 private:
  std::optional<SurfaceView> Sweep(int view, const SurfaceView& rendered) const {
    const StereoPlan plan =
        PlanStereo(scene_, view, SurfaceOf(view, rendered), training_, options_.depth_sources);
    if (plan.sources.empty()) return std::nullopt;
    std::vector<std::shared_ptr<const Image>> pictures;  // keeps them alive
    const auto posed = [&](int index) {
      pictures.push_back(small_.Luminance(index));
      return PosedLuminance{
          small_.WorkingCamera(index), scene_.views[index].cam_from_world, pictures.back().get()};
    };
    std::vector<PosedLuminance> sources;
    for (int index : plan.sources) sources.push_back(posed(index));
    const DepthMap map =
        SweepPlanes(posed(view), sources, plan.nearest, plan.farthest, options_.sweep, cancel_);
    SurfaceView swept = rendered;
    swept.depth = Resize(map.depth, rendered.camera.width, rendered.camera.height);
    return swept;
  }

  // Points that the view sees: tracked ones, or the Gaussians' surface.
  std::vector<Eigen::Vector3d> SurfaceOf(int view, const SurfaceView& rendered) const {
    if (tracked_[view].size() >= kLeastTracked) return tracked_[view];
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

  const Scene& scene_;
  const GaussianModel& geometry_;
  const CarryColorOptions& options_;
  const CancellationToken& cancel_;
  ViewImages images_;
  ViewImages small_;
  std::vector<int> training_;
  std::vector<std::vector<Eigen::Vector3d>> tracked_;  // by view
};

struct ColoredKeyView {
  int view = 0;
  ViewSurfaces surfaces;
  CarriedColor color;
};

CarriedColor CarryFromAll(const std::vector<ColoredKeyView>& keys,
                          const ViewSurfaces& target,
                          const CarryOptions& options) {
  const Camera& camera = target.gaussians.camera;
  CarriedColor all{Image(camera.width, camera.height, 2), Image(camera.width, camera.height, 1)};
  for (const ColoredKeyView& key : keys) {
    CarriedColor carried = CarryColor(
        key.surfaces.gaussians, key.color.ab, key.color.confidence, target.gaussians, options);
    if (key.surfaces.swept && target.swept) {
      TakeSurer(
          CarryColor(
              *key.surfaces.swept, key.color.ab, key.color.confidence, *target.swept, options),
          &carried);
    }
    FillFrom(carried, &all);
  }
  return all;
}

// The user's colours of a further key view, undistorted and reduced.
CarriedColor ColorOfFurther(const FurtherKeyView& further,
                            int view,
                            const Scene& scene,
                            const ViewImages& images,
                            StageContext& context) {
  KeyPhoto photo;
  photo.srgb = ReadImage(context.scene_folder() / scene.views[view].image_file);
  photo.luminance = LuminanceFromSrgb(photo.srgb);
  const KeyColorResult result = SolveKeyColor(further.color, photo, context);
  CarriedColor color;
  color.ab = images.Undistort(view, result.ab);
  color.confidence = result.confidence.Empty() ? Image(color.ab.width, color.ab.height, 1, 1.0f)
                                               : images.Undistort(view, result.confidence);
  return color;
}

std::vector<ColoredKeyView> ColorKeyViews(const CarryColorOptions& options,
                                          const Scene& scene,
                                          const SurfaceMaker& maker,
                                          StageContext& context) {
  std::vector<ColoredKeyView> keys(1);
  keys[0].view = ReadKeyView(context, scene);
  keys[0].surfaces = maker.Make(keys[0].view);
  const Camera& camera = keys[0].surfaces.gaussians.camera;
  const AbMap map = DecodeAbPng(context.ReadInput(artifact::kKeyColor), artifact::kKeyColor);
  keys[0].color = {Resize(map.ab, camera.width, camera.height),
                   Resize(map.confidence, camera.width, camera.height)};
  for (const FurtherKeyView& further : options.further) {
    context.cancel().ThrowIfCancelled();
    ColoredKeyView key;
    key.view = scene.FindView(further.view);
    if (scene.views[key.view].held_out) {
      throw InvalidArgument("the view " + scene.views[key.view].name +
                            " is held out for evaluation and cannot be a key view");
    }
    for (const ColoredKeyView& other : keys) {
      if (other.view == key.view) {
        throw InvalidArgument("the view " + scene.views[key.view].name +
                              " is a key view already; name each once");
      }
    }
    key.surfaces = maker.Make(key.view);
    // What the views before it have given stays; the user's colours fill the rest.
    key.color = CarryFromAll(keys, key.surfaces, options.carry);
    FillFrom(ColorOfFurther(further, key.view, scene, maker.images(), context), &key.color);
    keys.push_back(std::move(key));
  }
  return keys;
}

// carry.json, and a warning when the key views show next to nothing of the others.
void Conclude(const Scene& scene,
              const std::vector<ColoredKeyView>& keys,
              const std::vector<double>& coverage,
              StageContext& context) {
  std::vector<int> key_views;
  CarryFacts facts;
  for (const ColoredKeyView& key : keys) {
    key_views.push_back(key.view);
    facts.key_views.push_back(scene.views[key.view].name);
  }
  double sum = 0.0;
  for (size_t i = 0; i < coverage.size(); ++i) {
    facts.per_view.emplace_back(scene.views[i].name, coverage[i]);
    if (std::find(key_views.begin(), key_views.end(), static_cast<int>(i)) == key_views.end()) {
      sum += coverage[i];
    }
  }
  const size_t others = scene.views.size() - key_views.size();
  const double mean = others > 0 ? sum / static_cast<double>(others) : 1.0;
  facts.coverage = mean;
  if (const auto next = NextKeyView(scene, key_views)) {
    facts.next = {scene.views[next->view].name, next->covered_now, next->covered_with};
  }
  context.progress().OnError(0, "coverage", mean);
  if (mean < kSmallCoverage) {
    char percent[32];
    std::snprintf(percent, sizeof(percent), "%.1f %%", 100.0 * mean);
    context.progress().OnWarning(
        "the key view shows only " + std::string(percent) +
        " of what the other views show; their colours are inferred from likeness. Colour a second "
        "key view, or choose another one");
  }
  WriteCarryFacts(facts, context);
}

}  // namespace

void CarryColorOptions::Validate() const {
  CheckMaxSide(max_side_px);
  const RangeCheck check("carry_color option");
  check("depth_side_px", depth_side_px, 64, 2048);
  check("depth_sources", depth_sources, 1, 16);
  if (further.size() > 16) {
    throw InvalidArgument(std::to_string(further.size()) +
                          " further key views were given; at most 16 are taken");
  }
  sweep.Validate();
  carry.Validate();
}

void RunCarryColor(const CarryColorOptions& options, StageContext& context) {
  options.Validate();
  const Scene scene = ReadScene(context);
  const GaussianModel geometry = ParseGaussians(context.ReadInput(artifact::kGeometry));
  const SurfaceMaker maker(scene, geometry, options, context);
  const std::vector<ColoredKeyView> keys = ColorKeyViews(options, scene, maker, context);

  CarriedViews done(scene, context);
  ThreadPool pool(context.threads());
  pool.ForEach(static_cast<int64_t>(scene.views.size()), [&](int64_t index, int) {
    context.cancel().ThrowIfCancelled();
    const int view = static_cast<int>(index);
    if (done.WasDone(view)) return;
    const auto key = std::find_if(
        keys.begin(), keys.end(), [&](const ColoredKeyView& k) { return k.view == view; });
    const CarriedColor carried =
        key != keys.end() ? key->color : CarryFromAll(keys, maker.Make(view), options.carry);
    done.Add(view,
             key != keys.end() ? 1.0 : Coverage(carried, kCovered),
             EncodeAbPng(carried.ab, carried.confidence));
  });
  Conclude(scene, keys, done.coverage(), context);
}

}  // namespace color3d
