#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/splat/chroma/chroma_fit.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/chroma_budget.h"

namespace color3d {
void RunSolveChroma(const ChromaOptions& options, StageContext& context) {
  options.Validate();
  const Scene scene = ReadScene(context);
  const int key = ReadKeyView(context, scene);
  const GaussianModel geometry = ParseGaussians(context.ReadInput(artifact::kGeometry));
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
  GaussianModel model =
      FitChroma(geometry,
                ChromaProblemOf(scene, images, targets),
                ChromaWithinMemory(options, scene, geometry, context.MemoryBytes()),
                context.control());
  AdjustChroma(options.adjustment, &model);
  context.WriteOutput(artifact::kModel, SerializeGaussians(model));
}

}  // namespace color3d
