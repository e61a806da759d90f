#include <algorithm>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/error.h"
#include "core/carry/dense_points.h"
#include "core/catalogue/iteration_cap.h"
#include "core/image/codec.h"
#include "core/scene/masks/masked_points.h"
#include "core/scene/masks/still_regions.h"
#include "core/scene/view_images.h"
#include "core/splat/geometry/geometry_trainer.h"
#include "core/splat/geometry/warm_up.h"
#include "core/splat/model/gaussian_cap.h"
#include "core/splat/model/memory_plan.h"
#include "core/splat/training/hexplane_training.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"

namespace color3d {
namespace {

// A start on the surfaces: of the most Gaussians that there may be, this share at the most.
constexpr double kDenseShare = 0.5;

std::vector<Camera> TrainingCameras(const Scene& scene) {
  std::vector<Camera> cameras;
  for (int view : scene.TrainingViews()) cameras.push_back(scene.views[view].camera);
  return cameras;
}

MemoryPlan PlanMemory(const GeometryOptions& options,
                      int max_side_px,
                      const Scene& scene,
                      int64_t budget_bytes) {
  MemoryDemand demand;
  for (const View& view : scene.views) demand.views.push_back({view.captured_camera, view.camera});
  demand.max_side_px = max_side_px;
  demand.max_gaussians = options.max_gaussians;
  demand.sh_degree = options.sh_degree;
  demand.channels = options.warm_up < 1.0 ? 3 : 1;
  demand.moves = scene.HasTimes();
  if (demand.moves && options.motion == GeometryOptions::Motion::kAuto &&
      options.deformation == GeometryOptions::Deformation::kHexPlane) {
    demand.deformation_bytes =
        HexPlaneBytes(TuningOf(options).hexplane, static_cast<int>(scene.Times().size()));
  }
  return PlanGeometryMemory(demand, budget_bytes);
}

Scene WithoutMaskedPoints(Scene scene, const ViewImages& images) {
  scene.points = UnmaskedPoints(scene, images);
  return scene;
}

// `scene` with points of the surfaces that several photos agree on.
Scene WithDensePoints(Scene scene,
                      const ViewImages& images,
                      const PictureSource& still,
                      int max_gaussians,
                      const RunControl& run) {
  DensePointsOptions options;
  options.max_points = static_cast<int>(kDenseShare * max_gaussians);
  std::vector<SparsePoint> points = DensePoints(scene, images, options, run, still);
  std::ranges::move(points, std::back_inserter(scene.points));
  return scene;
}

// Static background of each view according to import; empty if import did not search for it.
PictureSource StillRegionsOf(const Scene& scene,
                             const ViewImages& images,
                             const StageContext& context) {
  if (context.InputsBelow(artifact::kMovingRegions).empty()) return {};
  return [&](int view) -> std::shared_ptr<const Image> {
    const std::string name = ViewArtifact(artifact::kMovingRegions, scene.views[view]);
    if (!context.HasInput(name)) return nullptr;
    return std::make_shared<const Image>(
        StillRegion(images, scene, view, ReadPicture(context, name)));
  };
}

std::string MemoryPlanToJson(const MemoryPlan& plan) {
  return nlohmann::ordered_json{{"max_side_px", plan.max_side_px},
                                {"max_gaussians", plan.max_gaussians},
                                {"estimated_bytes", plan.estimated_bytes},
                                {"budget_bytes", plan.budget_bytes},
                                {"note", plan.note}}
             .dump(1) +
         "\n";
}

void CheckWarmUp(const GeometryOptions& options) {
  if (options.warm_up == 1.0 || options.recipe == GeometryOptions::Recipe::kPaper) return;
  throw InvalidArgument(
      "reconstruct_geometry.warm_up is {}, but only recipe=paper leaves a part of the training to "
      "solve_chroma; choose it or leave warm_up out",
      options.warm_up);
}

// Fewer Gaussians and iterations for a small scene. The paper's recipe takes both as given.
GeometryOptions ForScene(GeometryOptions options,
                         const Scene& scene,
                         int max_side_px,
                         StageContext& context) {
  if (options.recipe == GeometryOptions::Recipe::kPaper) return options;
  const std::vector<Camera> cameras = TrainingCameras(scene);
  const int asked = options.iterations;
  options.max_gaussians = GaussianCap(options.max_gaussians, cameras, max_side_px);
  options.iterations = IterationCap(asked, static_cast<int>(cameras.size()));
  if (options.iterations < asked && asked != GeometryOptions().iterations) {
    context.Warn(
        "{} iterations are done of the {} asked for: with {} training views more gain nothing "
        "(recipe=paper does all)",
        options.iterations,
        asked,
        cameras.size());
  }
  return options;
}

// Gaussians that came with the scene, as they are, count as the result of a warm-up.
void ForwardGivenGeometry(const GeometryOptions& options, int max_side_px, StageContext& context) {
  const std::string bytes = context.ReadInput(artifact::kGivenGeometry);
  context.WriteOutput(artifact::kGeometry, bytes);
  if (options.warm_up == 1.0) return;
  const GaussianModel geometry = ParseGaussians(bytes);
  WarmUp warm_up{options, max_side_px, int64_t{512} << 20, {}};
  warm_up.options.tuning = TuningOf(options);
  warm_up.options.sh_degree = geometry.sh_degree;
  warm_up.options.max_gaussians =
      std::max(options.max_gaussians, static_cast<int>(geometry.size()));
  warm_up.state = StateOf(geometry, warm_up.options);
  context.WriteOutput(artifact::kWarmUp, SerializeWarmUp(warm_up));
}

}  // namespace

void RunReconstructGeometry(const GeometryOptions& options,
                            int max_side_px,
                            StageContext& context) {
  options.Validate();
  CheckMaxSide(max_side_px);
  CheckWarmUp(options);
  if (context.HasInput(artifact::kGivenGeometry)) {
    ForwardGivenGeometry(options, max_side_px, context);
    return;
  }
  const Scene scene = ReadScene(context);
  GeometryOptions planned = ForScene(options, scene, max_side_px, context);
  const MemoryPlan memory = PlanMemory(planned, max_side_px, scene, context.MemoryBytes());
  planned.max_gaussians = memory.max_gaussians;
  if (!memory.note.empty()) context.Warn(memory.note);
  const ViewImages images(
      scene, context.scene_folder(), memory.max_side_px, memory.image_cache_bytes);
  const Scene unmasked = WithoutMaskedPoints(scene, images);
  const PictureSource still = StillRegionsOf(scene, images, context);
  // One place shows no surface from two sides.
  const Scene start =
      options.recipe == GeometryOptions::Recipe::kPaper || !options.dense_start || scene.relief
          ? unmasked
          : WithDensePoints(unmasked, images, still, planned.max_gaussians, context.control());
  GeometryProblem problem = GeometryProblemOf(start, images);
  problem.still = still;
  problem.picture_cache_bytes = memory.target_cache_bytes;
  WarmUp warm_up{planned, memory.max_side_px, memory.target_cache_bytes, {}};
  const GaussianModel model =
      TrainGeometry(problem, planned, context.control(), nullptr, &warm_up.state);
  context.WriteOutput(artifact::kGeometry, SerializeGaussians(model));
  if (planned.warm_up < 1.0) {
    warm_up.options.tuning = TuningOf(planned);
    context.WriteOutput(artifact::kWarmUp, SerializeWarmUp(warm_up));
  }
  context.WriteOutput(artifact::kMemoryPlan, MemoryPlanToJson(memory));
}

}  // namespace color3d
