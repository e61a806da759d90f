#include <map>
#include <mutex>

#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/splat/chroma/chroma_fit.h"
#include "core/stage/formats/artifacts.h"
#include "core/stage/stages.h"

namespace color3d {
void RunSolveChroma(const ChromaOptions& options, StageContext& context) {
  options.Validate();
  const Scene scene = ReadScene(context);
  const int key = ReadKeyView(context, scene);
  const GaussianModel geometry = ParseGaussians(context.ReadInput(artifact::kGeometry));
  if (scene.IsFilm()) {  // nothing was reconstructed
    context.WriteOutput(artifact::kModel, SerializeGaussians(geometry));
    return;
  }
  const ViewImages images(scene, context.scene_folder(), ColoredSide(context, scene.views[key]));
  std::map<int, std::shared_ptr<const ChromaTarget>> cache;
  std::mutex mutex;
  const ChromaTargetSource targets = [&](int view) {
    std::lock_guard lock(mutex);
    auto& target = cache[view];
    if (!target) {
      const Camera camera = images.WorkingCamera(view);
      auto made = std::make_shared<ChromaTarget>();
      made->ab = ReadTargetAb(context, scene.views[view], view == key, camera.width, camera.height);
      made->confidence =
          ReadViewConfidence(context, scene.views[view], camera.width, camera.height);
      if (made->confidence.Empty() && view == key) {
        made->confidence = Image(camera.width, camera.height, 1, 1.0f);
      }
      if (const auto mask = images.Mask(view)) made->weight = *mask;
      target = std::move(made);
    }
    return target;
  };
  GaussianModel model =
      FitChroma(geometry, ChromaProblemOf(scene, images, targets), options, context.control());
  AdjustChroma(options.adjustment, &model);
  context.WriteOutput(artifact::kModel, SerializeGaussians(model));
}

}  // namespace color3d
