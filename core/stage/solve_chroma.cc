#include <utility>
#include <vector>

#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/splat/chroma/chroma_fit.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "core/stage/solve_chroma_jointly.h"
#include "core/stage/sources/chroma_budget.h"
#include "core/stage/sources/held_out_chroma.h"
#include "core/stage/sources/view_disagreement.h"

namespace color3d {
namespace {

// The closed form, whose chroma is not used.
ChromaOptions ForConfidenceAlone(ChromaOptions options) {
  options.solver = ChromaOptions::Solver::kConjugateGradients;
  options.color_space = ColorSpace::kLab;
  options.iterations = 0;
  options.chroma_sh_degree = 0;
  return options;
}

}  // namespace

void RunSolveChroma(const ChromaOptions& options, StageContext& context) {
  options.Validate();
  const Scene scene = ReadScene(context);
  const int key = ReadKeyView(context, scene);
  const bool jointly = options.solver == ChromaOptions::Solver::kJoint;
  const GaussianModel geometry = jointly ? SolveChromaJointly(options, scene, key, context)
                                         : ParseGaussians(context.ReadInput(artifact::kGeometry));
  const ViewImages images(scene, context.scene_folder(), ColoredSide(context, scene.views[key]), 0);
  const ChromaTargetSource targets = [&](int view) {
    const Camera camera = images.WorkingCamera(view);
    auto target = std::make_shared<ChromaTarget>();
    target->ab = ReadTargetAb(context, scene.views[view], view == key, camera.width, camera.height);
    target->confidence =
        ReadViewConfidence(context, scene.views[view], camera.width, camera.height);
    if (target->confidence.Empty() && view == key) {
      target->confidence = Image(camera.width, camera.height, 1, 1.0f);
    }
    if (const auto mask = images.Mask(view)) target->weight = *mask;
    return target;
  };
  ChromaOptions fit = ChromaWithinMemory(options, scene, geometry, context.MemoryBytes());
  if (jointly) fit = ForConfidenceAlone(fit);
  ChromaProblem problem = ChromaProblemOf(scene, images, targets);
  if (!jointly) problem.snapshot = ObserveHeldOutChroma(scene, images, context);
  const RunControl control = context.control();
  ViewDisagreement disagreement(control.progress);
  GaussianModel model = FitChroma(
      geometry, problem, fit, {control.pool, control.checkpoints, disagreement, control.cancel});
  if (jointly) {
    std::vector<float> confidence = std::move(model.confidence);
    model = geometry;
    model.confidence = std::move(confidence);
  }
  AdjustChroma(options.adjustment, &model);
  context.WriteOutput(artifact::kModel, SerializeGaussians(model));
  disagreement.Report();
}

}  // namespace color3d
