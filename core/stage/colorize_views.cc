#include "core/image/codec.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifacts.h"
#include "core/stage/stages.h"

namespace color3d {

ColorSources SourcesOf(const Colorizer& colorizer) {
  return {
      [&colorizer](const Image& luminance, const Image& known) {
        ColorPrediction predicted = colorizer.Predict(luminance, known);
        return InferredColor{std::move(predicted.ab), std::move(predicted.distance)};
      },
      [](const Image& luminance) { return AutomaticColorizer::Embedded()->Colorize(luminance).ab; },
      colorizer.relative_chroma()};
}

void RunColorizeViews(int max_side_px, StageContext& context, const std::string& encoder) {
  CheckMaxSide(max_side_px);
  const Scene scene = ReadScene(context);
  const auto colorizer = LoadColorizer(context.ReadInput(artifact::kColorizer),
                                       context.LoadEncoder(encoder),
                                       context.pool().thread_count());
  const ColorSources sources = SourcesOf(*colorizer);
  const ViewImages images(scene, context.scene_folder(), max_side_px, 0);
  const auto total = static_cast<int64_t>(scene.views.size());
  for (int64_t i = 0; i < total; ++i) {
    context.cancel().ThrowIfCancelled();
    const View& view = scene.views[static_cast<size_t>(i)];
    const auto luminance = images.Luminance(static_cast<int>(i));
    const CarriedColor carried = ReadCarried(context, view, luminance->width, luminance->height);
    const FusedColor fused =
        ColorOfView(*luminance, carried, sources, context.pool(), context.cancel());
    context.WriteOutput(ViewArtifact(artifact::kViewsAb, view, ".png"), EncodeAbPng(fused.ab));
    context.WriteOutput(ViewArtifact(artifact::kProvenance, view, ".png"),
                        EncodePng8(fused.provenance));
    context.progress().OnProgress(i + 1, total, "colouring " + view.name);
  }
}

}  // namespace color3d
