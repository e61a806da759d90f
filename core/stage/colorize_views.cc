#include <atomic>
#include <memory>
#include <optional>
#include <utility>

#include "core/colorizer/personal/train_colorizer.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/scene/view_images.h"
#include "core/stage/film/color_frames.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/carry_facts.h"
#include "core/stage/formats/views_checkpoint.h"
#include "core/stage/recolor/recolored_views.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/view_positions.h"

namespace color3d {
namespace {

constexpr int64_t kColoredFramesCacheBytes = int64_t{32}
                                             << 20;  // neighbouring views are read several times

}  // namespace

ColorSources SourcesOf(const Colorizer& colorizer,
                       std::function<Image(const Image& luminance)> position) {
  return {
      [&colorizer, position = std::move(position)](const Image& luminance, const Image& known) {
        ColorPrediction predicted =
            colorizer.Predict(luminance, {known, position ? position(luminance) : Image()});
        return InferredColor{std::move(predicted.ab), std::move(predicted.distance)};
      },
      [](const Image& luminance) { return AutomaticColorizer::Embedded()->Colorize(luminance).ab; },
      colorizer.relative_chroma()};
}

void RunColorizeViews(int max_side_px, StageContext& context, const std::string& encoder) {
  CheckMaxSide(max_side_px);
  const Scene scene = ReadScene(context);
  // Colours views concurrently, each on one thread.
  const auto colorizer = LoadColorizer(
      context.ReadInput(artifact::kColorizer), context.LoadEncoder(encoder), /*threads=*/1);
  const ViewPositions positions(scene, context);
  const bool are_frames = scene.HasTimes() && !positions.IsStatic();
  const ViewImages images(
      scene, context.scene_folder(), max_side_px, are_frames ? kColoredFramesCacheBytes : 0);
  const auto total = std::ssize(scene.views);
  const auto sources = [&](int number) {
    return SourcesOf(*colorizer, [&, number](const Image& luminance) {
      return positions.Of(
          number, images.WorkingCamera(number), luminance, images.Mask(number).get());
    });
  };
  ViewsCheckpoint done(scene, context);
  if (are_frames) {
    FrameColoring coloring;
    coloring.sources = sources;
    coloring.deliver = [&](int number, const FusedColor& color) { done.Add(number, color); };
    coloring.was_done = [&](int number) { return done.WasDone(number); };
    for (const std::string& name : ReadCarryFacts(context).key_views) {
      coloring.key_views.push_back(scene.FindView(name));
    }
    return ColorFrames(scene, images, coloring, context);
  }
  const auto recolorer = ViewRecolorer::Read(scene, images, positions, *colorizer, context);
  std::atomic<int> gray_views = 0;
  context.pool().ForEach(total, [&](int64_t index, int) {
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
        total);
  }
}

}  // namespace color3d
