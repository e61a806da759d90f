#include "core/stage/coloring/unplaced_photos.h"

#include <fmt/format.h>

#include <numeric>

#include "core/image/codec.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/sources/picture_carry.h"

namespace color3d {
namespace {

// All photos of a scene: its views, then those that are unplaced.
Scene AllPhotos(const Scene& scene) {
  Scene all;
  all.views = scene.views;
  all.views.insert(all.views.end(), scene.unplaced.begin(), scene.unplaced.end());
  return all;
}

}  // namespace

void ColorUnplacedPhotos(const ViewColoring& coloring, StageContext& context) {
  const Scene& scene = coloring.scene;
  if (scene.unplaced.empty()) return;
  const Scene all = AllPhotos(scene);
  const int placed = static_cast<int>(scene.views.size());
  const int count = static_cast<int>(all.views.size());
  const ViewImages images(all, context.scene_folder(), coloring.options.max_side_px);
  const auto report = [&](size_t photos) {
    context.ReportProgress(
        placed, count, fmt::format("looking for the scene in {} photos outside of it", photos));
  };
  const FilmCarryOptions carry_options;
  PictureCarry carry(images, count, /*channels=*/2, carry_options, context);
  for (int view = 0; view < placed; ++view) {
    carry.SetReader(view, [&, view] {
      const Camera camera = images.WorkingCamera(view);
      return ReadCarried(context, all.views[view], camera.width, camera.height);
    });
  }
  std::vector<int> sources(placed);
  std::iota(sources.begin(), sources.end(), 0);
  carry.Run(sources, report);
  context.pool().ForEach(count - placed, [&](int64_t i, int) {
    context.ThrowIfCancelled();
    const int photo = placed + static_cast<int>(i);
    ThreadPool one(1);
    const FusedColor color = FuseViewColor(*images.Luminance(photo),
                                           carry.ColorOf(photo),
                                           FusionSources(coloring),
                                           one,
                                           context.cancel());
    context.WriteOutput(ViewArtifact(artifact::kViewsAb, all.views[photo]), EncodeAbPng(color.ab));
  });
}

}  // namespace color3d
