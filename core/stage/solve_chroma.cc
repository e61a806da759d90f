#include <map>
#include <mutex>

#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/splat/chroma/chroma_fit.h"
#include "core/stage/formats/artifacts.h"
#include "core/stage/stages.h"

namespace color3d {
namespace {

// The key view's colours are the user's own, as far as there are any; all else is the colorizer's
// prediction.
void TakePainted(const CarriedColor& key_color, Image* ab) {
  for (int c = 0; c < 2; ++c) {
    for (size_t i = 0; i < key_color.confidence.data.size(); ++i) {
      if (key_color.confidence.data[i] > 0.0f) ab->Plane(c)[i] = key_color.ab.Plane(c)[i];
    }
  }
}

}  // namespace

void RunSolveChroma(const ChromaOptions& options, StageContext& context) {
  options.Validate();
  const Scene scene = ReadScene(context);
  const int key = ReadKeyView(context, scene);
  const GaussianModel geometry = ParseGaussians(context.ReadInput(artifact::kGeometry));
  const ViewImages images(scene, context.scene_folder(), ColoredSide(context, scene.views[key]));
  std::map<int, std::shared_ptr<const ChromaTarget>> cache;
  std::mutex mutex;
  const ChromaTargetSource targets = [&](int view) {
    std::lock_guard lock(mutex);
    auto& target = cache[view];
    if (!target) {
      const Camera camera = images.WorkingCamera(view);
      auto made = std::make_shared<ChromaTarget>();
      made->ab = ReadViewAb(context, scene.views[view], camera.width, camera.height);
      if (view == key) TakePainted(ReadKeyColor(context, camera.width, camera.height), &made->ab);
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
  const GaussianModel model =
      FitChroma(geometry, ChromaProblemOf(scene, images, targets), options, context.control());
  context.WriteOutput(artifact::kModel, SerializeGaussians(model));
}

}  // namespace color3d
