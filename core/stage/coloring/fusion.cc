#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <utility>

#include "core/keycolor/automatic/automatic.h"
#include "core/stage/coloring/recolored_views.h"
#include "core/stage/coloring/view_coloring.h"
#include "core/stage/film/color_frames.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/carry_facts.h"

namespace color3d {

ColorSources SourcesOf(const Colorizer& colorizer,
                       std::function<Image(const Image& luminance)> position) {
  return {
      [&colorizer, position = std::move(position)](const Image& luminance, const Image& known) {
        if (std::ranges::find(known.data, 0.0f) == known.data.end()) {
          return InferredColor{Image(known.width, known.height, 2),
                               Image(known.width, known.height, 1)};
        }
        ColorPrediction predicted =
            colorizer.Predict(luminance, {known, position ? position(luminance) : Image()});
        return InferredColor{std::move(predicted.ab), std::move(predicted.distance)};
      },
      [](const Image& luminance) { return AutomaticColorizer::Embedded()->Colorize(luminance).ab; },
      colorizer.relative_chroma()};
}

ColorSources FusionSources(const ViewColoring& coloring,
                           std::function<Image(const Image& luminance)> position) {
  ColorSources sources = SourcesOf(*coloring.colorizer, std::move(position));
  sources.spread = coloring.options.spread;
  if (coloring.options.guess) return sources;
  // Without distances nothing is guessed.
  sources.infer = [infer = std::move(sources.infer)](const Image& luminance, const Image& known) {
    return InferredColor{infer(luminance, known).ab, Image()};
  };
  return sources;
}

void ColorByFusion(const ViewColoring& coloring, StageContext& context) {
  const Scene& scene = coloring.scene;
  const ViewImages& images = coloring.images;
  ViewsCheckpoint& done = coloring.done;
  const auto sources = [&](int number) {
    return FusionSources(coloring, [&, number](const Image& luminance) {
      return coloring.positions.Of(
          number, images.WorkingCamera(number), luminance, images.Mask(number).get());
    });
  };
  if (coloring.are_frames) {
    FrameColoring frames;
    frames.sources = sources;
    frames.deliver = [&](int number, const FusedColor& color) { done.Add(number, color); };
    frames.was_done = [&](int number) { return done.WasDone(number); };
    for (const std::string& name : ReadCarryFacts(context).key_views) {
      frames.key_views.push_back(scene.FindView(name));
    }
    return ColorFrames(scene, images, frames, context);
  }
  const auto recolorer =
      ViewRecolorer::Read(scene, images, coloring.positions, *coloring.colorizer, context);
  std::atomic<int> gray_views = 0;
  context.pool().ForEach(std::ssize(scene.views), [&](int64_t index, int) {
    context.ThrowIfCancelled();
    const auto number = static_cast<int>(index);
    if (done.WasDone(number)) return;
    if (recolorer) {
      if (const std::optional<FusedColor> color = recolorer->Recolor(number)) {
        return done.Add(number, *color);
      }
      ++gray_views;
    }
    const auto luminance = images.Luminance(number);
    const CarriedColor carried =
        ReadCarried(context, scene.views[index], luminance->width, luminance->height);
    ThreadPool one(1);
    done.Add(number, FuseViewColor(*luminance, carried, sources(number), one, context.cancel()));
  });
  if (gray_views > 0) {
    context.Warn(
        "{} of {} photos are grey and have no colours of their own to keep beside the edit: they "
        "get all colours from the edited key view. To keep theirs, give these photos in colour",
        gray_views.load(),
        scene.views.size());
  }
}

}  // namespace color3d
