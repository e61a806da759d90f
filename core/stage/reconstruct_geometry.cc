#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/carry/dense_points.h"
#include "core/image/codec.h"
#include "core/scene/masks/masked_points.h"
#include "core/scene/masks/still_regions.h"
#include "core/scene/view_images.h"
#include "core/splat/geometry/geometry_trainer.h"
#include "core/splat/model/gaussian_cap.h"
#include "core/splat/model/memory_plan.h"
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
  demand.moves = scene.HasTimes();
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

}  // namespace

void RunReconstructGeometry(const GeometryOptions& options,
                            int max_side_px,
                            StageContext& context) {
  options.Validate();
  CheckMaxSide(max_side_px);
  if (context.HasInput(artifact::kGivenGeometry)) {
    context.WriteOutput(artifact::kGeometry, context.ReadInput(artifact::kGivenGeometry));
    return;
  }
  const Scene scene = ReadScene(context);
  GeometryOptions planned = options;
  planned.max_gaussians = GaussianCap(options.max_gaussians, TrainingCameras(scene), max_side_px);
  if (options.recipe == GeometryOptions::Recipe::kColor3d) {
    planned.iterations =
        IterationCap(options.iterations, static_cast<int>(scene.TrainingViews().size()));
  }
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
  const GaussianModel model = TrainGeometry(problem, planned, context.control());
  context.WriteOutput(artifact::kGeometry, SerializeGaussians(model));
  context.WriteOutput(artifact::kMemoryPlan, MemoryPlanToJson(memory));
}

}  // namespace color3d
