#include "core/splat/chroma/chroma_fit.h"

#include <utility>

#include "core/base/error.h"
#include "core/splat/chroma/chroma_adam.h"
#include "core/splat/chroma/chroma_solver.h"
#include "core/splat/chroma/chroma_start.h"
#include "core/splat/chroma/chroma_targets.h"
#include "core/splat/raster/raster_camera.h"

namespace color3d {

ChromaProblem ChromaProblemOf(const Scene& scene,
                              const ViewImages& images,
                              ChromaTargetSource targets) {
  ChromaProblem problem;
  problem.training = PosedCameras(scene, images, scene.TrainingViews());
  problem.targets = std::move(targets);
  return problem;
}

GaussianModel FitChroma(const GaussianModel& geometry,
                        const ChromaProblem& problem,
                        const ChromaOptions& options,
                        const RunControl& run) {
  options.Validate();
  if (problem.training.empty()) {
    throw InvalidArgument("the scene has no training views; give at least one posed photo");
  }
  if (options.solver == ChromaOptions::Solver::kJoint) {
    throw Error(ErrorCode::kInternal, "the joint solver trains geometry, it does not fit chroma");
  }
  const ChromaClock clock;
  ChromaParameters parameters = ChromaParameters::From(geometry, options.chroma_sh_degree);
  const bool solve =
      options.solver == ChromaOptions::Solver::kConjugateGradients && options.iterations > 0;
  GeometryInTime in_time(geometry, run.pool);
  ChromaTargets targets(problem, options.target_budget_bytes);
  ChromaSystem system(
      parameters.block, parameters.color, in_time, targets, options.memory_budget_bytes, run.pool);
  std::vector<int> colored;  // positions in problem.training
  bool all_confident = true;
  for (size_t k = 0; k < problem.training.size(); ++k) {
    run.cancel.ThrowIfCancelled();
    const PosedCamera& view = problem.training[k];
    ChromaPlanes planes;
    if (!LoadChromaPlanes(problem, view, &planes)) continue;
    colored.push_back(static_cast<int>(k));
    all_confident = all_confident && planes.has_confidence;
    if (!system.AddView(view, planes, solve)) targets.Offer(view, std::move(planes));
    run.progress.OnProgress(static_cast<int64_t>(k), 0, "chroma: reading the coloured views");
  }
  const std::vector<char> seen = SetClosedForm(system, run.pool, parameters);
  const ChromaFitting fitting{geometry, problem, options, run, clock};
  fitting.Snapshot(0, parameters);
  if (options.iterations > 0 && !colored.empty()) {
    if (solve) {
      SolveChroma(fitting, seen, system, parameters);
    } else {
      TrainChromaWithAdam(fitting, colored, targets, parameters);
    }
    FillUnseen(seen, run.pool, parameters);
  }
  GaussianModel model = parameters.ToModel(geometry);
  model.confidence.clear();  // of an earlier chroma
  if (all_confident && !colored.empty()) model.confidence = MeanConfidence(system, seen);
  return model;
}

}  // namespace color3d
