#include "core/stage/coloring/colored_photos.h"

#include <algorithm>
#include <string>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/stage/film/film_writer.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {
namespace {

Image WriteInColor(
    const View& view, int index, bool is_key, const ViewImages& images, StageContext& context) {
  Image srgb = SrgbFromLab(ColoredFrame(view, index, is_key, images, context));
  context.WriteOutput(ViewArtifact(artifact::kColoredPhotos, view), EncodePng8(srgb));
  return srgb;
}

}  // namespace

void WriteColoredPhotos(const RenderOptions& options,
                        const Scene& scene,
                        const std::vector<int>& views,
                        StageContext& context) {
  const ViewImages images(scene, context.scene_folder(), /*max_side_px=*/0, 0);
  const int key = ReadKeyView(context, scene);
  const auto count = std::ssize(scene.views);
  for (int i = 0; i < count; ++i) {  // one at a time: photos may be large
    context.ThrowIfCancelled();
    const View& view = scene.views[static_cast<size_t>(i)];
    const Image srgb = WriteInColor(view, i, i == key, images, context);
    if (std::ranges::find(views, i) != views.end()) {
      context.WriteOutput(ViewArtifact(artifact::kRenders, view),
                          EncodePng8(FitWithin(srgb, options.max_side_px)));
    }
    context.ReportProgress(i + 1, count, "writing " + view.name);
  }
}

void WriteUnplacedPhotos(const Scene& scene, StageContext& context) {
  Scene pictures;
  pictures.views = scene.unplaced;
  const ViewImages images(pictures, context.scene_folder(), /*max_side_px=*/0, 0);
  const auto count = std::ssize(pictures.views);
  for (int i = 0; i < count; ++i) {
    context.ThrowIfCancelled();
    const View& view = pictures.views[static_cast<size_t>(i)];
    if (!context.HasInput(ViewArtifact(artifact::kViewsAb, view))) continue;
    WriteInColor(view, i, /*is_key=*/false, images, context);
    context.ReportProgress(i + 1, count, "writing " + view.name);
  }
}

}  // namespace color3d
