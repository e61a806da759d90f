#include "core/carry/fusion.h"
#include "core/image/codec.h"
#include "core/keycolor/automatic.h"
#include "core/scene/view_images.h"
#include "core/stage/artifacts.h"
#include "core/stage/stages.h"

namespace color3d {
namespace {

constexpr double kWorthGuessing = 0.02;  // share of a view's pixels

// The automatic guess where enough of the view is strange and was not carried; empty otherwise.
Image GuessIfNeeded(const Image& luminance,
                    const CarriedColor& carried,
                    const Image& distance,
                    const FusionOptions& options) {
  size_t strange = 0;
  for (size_t i = 0; i < distance.data.size(); ++i) {
    strange += distance.data[i] > options.guess_begins &&
                       carried.confidence.data[i] <= options.least_confidence
                   ? 1
                   : 0;
  }
  return static_cast<double>(strange) > kWorthGuessing * static_cast<double>(luminance.PlaneSize())
             ? AutomaticColorizer::Embedded()->Colorize(luminance).ab
             : Image();
}

// 1 where what was carried decides alone.
Image SurelyCarried(const CarriedColor& carried) {
  constexpr float kSure = 0.5f;
  Image sure = carried.confidence;
  for (float& value : sure.data) value = value > kSure ? 1.0f : 0.0f;
  return sure;
}

// The colorizer is not asked about places that are known: what was carried there stands for its
// answer, so that it does not pull towards anything else.
void AnswerKnown(const CarriedColor& carried, const Image& known, Image* inferred_ab) {
  for (size_t i = 0; i < known.data.size(); ++i) {
    if (known.data[i] == 0.0f) continue;
    for (int c = 0; c < 2; ++c) inferred_ab->Plane(c)[i] = carried.ab.Plane(c)[i];
  }
}

}  // namespace

void RunColorizeViews(int max_side_px, StageContext& context, const std::string& encoder) {
  CheckMaxSide(max_side_px);
  const Scene scene = ReadScene(context);
  const auto colorizer = LoadColorizer(
      context.ReadInput(artifact::kColorizer), context.LoadEncoder(encoder), context.threads());
  const ViewImages images(scene, context.scene_folder(), max_side_px, 0);
  const FusionOptions options;
  ThreadPool pool(context.threads());
  const auto total = static_cast<int64_t>(scene.views.size());
  for (int64_t i = 0; i < total; ++i) {
    context.cancel().ThrowIfCancelled();
    const View& view = scene.views[static_cast<size_t>(i)];
    const auto luminance = images.Luminance(static_cast<int>(i));
    const CarriedColor carried = ReadCarried(context, view, luminance->width, luminance->height);
    const Image known = SurelyCarried(carried);
    ColorPrediction inferred = colorizer->Predict(*luminance, known);
    AnswerKnown(carried, known, &inferred.ab);
    const FusedColor fused =
        FuseColors(*luminance,
                   carried,
                   inferred.ab,
                   inferred.distance,
                   GuessIfNeeded(*luminance, carried, inferred.distance, options),
                   options,
                   pool,
                   context.cancel());
    context.WriteOutput(ViewArtifact(artifact::kViewsAb, view, ".png"), EncodeAbPng(fused.ab));
    context.WriteOutput(ViewArtifact(artifact::kProvenance, view, ".png"),
                        EncodePng8(fused.provenance));
    context.progress().OnProgress(i + 1, total, "colouring " + view.name);
  }
}

}  // namespace color3d
