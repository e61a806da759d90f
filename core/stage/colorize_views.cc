#include "core/colorizer/personal/train_colorizer.h"
#include "core/scene/view_images.h"
#include "core/stage/coloring/unplaced_photos.h"
#include "core/stage/coloring/view_coloring.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/views_checkpoint.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/view_positions.h"

namespace color3d {
namespace {

constexpr int64_t kColoredFramesCacheBytes = int64_t{32}
                                             << 20;  // neighbouring views are read several times

ColorizerParts PartsFor(ColorizeViewsOptions::Method method) {
  using Method = ColorizeViewsOptions::Method;
  if (method == Method::kNearestNeighbors) return ColorizerParts::kNeighbors;
  if (method == Method::kDecoder) return ColorizerParts::kDecoder;
  return ColorizerParts::kBoth;
}

}  // namespace

void RunColorizeViews(const ColorizeViewsOptions& options,
                      StageContext& context,
                      const std::string& encoder) {
  options.Validate();
  const Scene scene = ReadScene(context);
  std::shared_ptr<const Colorizer> colorizer;
  if (options.NeedsColorizer()) {
    // Colours views concurrently, each on one thread.
    colorizer = LoadColorizer(context.ReadInput(artifact::kColorizer),
                              context.LoadEncoder(encoder),
                              /*threads=*/1,
                              {PartsFor(options.method), options.full_size});
  }
  const ViewPositions positions(scene, context);
  const bool are_frames = scene.HasTimes() && !positions.IsStatic();
  const ViewImages images(scene,
                          context.scene_folder(),
                          options.max_side_px,
                          are_frames ? kColoredFramesCacheBytes : 0);
  ViewsCheckpoint done(scene, context);
  const ViewColoring coloring{scene, images, positions, options, colorizer, are_frames, done};
  MethodOf(options.method)(coloring, context);
  if (options.method == ColorizeViewsOptions::Method::kFusion) {
    ColorUnplacedPhotos(coloring, context);
  }
}

}  // namespace color3d
