#include "core/stage/coloring/colored_photos.h"

#include <algorithm>
#include <string>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/stage/film/film_writer.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {

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
    const Image srgb = SrgbFromLab(ColoredFrame(view, i, i == key, images, context));
    context.WriteOutput(ViewArtifact(artifact::kColoredPhotos, view), EncodePng8(srgb));
    if (std::ranges::find(views, i) != views.end()) {
      context.WriteOutput(ViewArtifact(artifact::kRenders, view),
                          EncodePng8(FitWithin(srgb, options.max_side_px)));
    }
    context.ReportProgress(i + 1, count, "writing " + view.name);
  }
}

}  // namespace color3d
