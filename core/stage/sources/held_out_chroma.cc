#include "core/stage/sources/held_out_chroma.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/evenly.h"
#include "core/catalogue/error_model.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/metrics/view_scores.h"
#include "core/scene/photo_masks.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/sources/render_view.h"

namespace color3d {
namespace {

constexpr int kViews = 2;
constexpr int kSidePx = 200;

struct PredictedView {
  int view = 0;
  Camera camera;
  Image srgb;  // with the predicted chroma
  Image mask;  // empty: all pixels count

  bool HasPixels() const {
    return mask.Empty() || std::ranges::any_of(mask.data, [](float m) { return m > 0.0f; });
  }
};

PredictedView ReadPredicted(int view,
                            const Scene& scene,
                            const ViewImages& images,
                            const StageContext& context) {
  PredictedView predicted;
  predicted.view = view;
  predicted.camera = images.WorkingCamera(view).FitWithin(kSidePx);
  const int width = predicted.camera.width, height = predicted.camera.height;
  predicted.srgb = SrgbFromLab(JoinLab(Resize(*images.Luminance(view), width, height),
                                       ReadViewAb(context, scene.views[view], width, height)));
  if (const auto mask = images.Mask(view)) predicted.mask = ResizeMask(*mask, width, height);
  return predicted;
}

}  // namespace

ChromaSnapshot ObserveHeldOutChroma(const Scene& scene,
                                    const ViewImages& images,
                                    StageContext& context) {
  std::vector<int> candidates;
  for (const int view : scene.HeldOutViews()) {
    if (context.HasInput(ViewArtifact(artifact::kViewsAb, scene.views[view], ".png"))) {
      candidates.push_back(view);
    }
  }
  auto views = std::make_shared<std::vector<PredictedView>>();
  for (const int view : PickEvenly(std::move(candidates), kViews)) {
    PredictedView predicted = ReadPredicted(view, scene, images, context);
    if (predicted.HasPixels()) views->push_back(std::move(predicted));
  }
  if (views->empty()) return {};
  return [views, &scene, &context](int64_t iteration, const std::function<GaussianModel()>& model) {
    const GaussianModel current = model();
    double sum = 0.0;
    for (const PredictedView& predicted : *views) {
      const Image lab =
          RenderView(current, scene.views[predicted.view], predicted.camera, context.pool()).lab;
      const Image* mask = predicted.mask.Empty() ? nullptr : &predicted.mask;
      sum += ChromaError(predicted.srgb, lab, mask);
    }
    const auto count = static_cast<double>(views->size());
    context.progress().OnError(iteration, kHeldOutChromaCurve, sum / count);
  };
}

}  // namespace color3d
