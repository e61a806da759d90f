#include "core/stage/carry/carry_through_geometry.h"

#include <algorithm>
#include <utility>

#include "core/image/codec.h"
#include "core/scene/photo_masks.h"
#include "core/stage/carry/carry_results.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/carry_checkpoint.h"
#include "core/stage/formats/edited_share.h"
#include "core/stage/formats/key_views.h"
#include "core/stage/sources/render_view.h"

namespace color3d {
namespace {

SurfaceRenderer RendererOf(const Scene& scene, const GaussianModel& geometry) {
  return [&scene, &geometry](int index, const Camera& camera) {
    ThreadPool one(1);
    const View& view = scene.views[index];
    RenderedView seen = RenderView(geometry, view, camera, one);
    return RenderedSurface{std::move(seen.median_depth), std::move(seen.opacity)};
  };
}

// Adds `plane` (1 channel) as the last channel; does nothing if it is empty.
void AddChannel(const Image& plane, Image* image) {
  if (plane.Empty()) return;
  ++image->channels;
  image->data.insert(image->data.end(), plane.data.begin(), plane.data.end());
}

}  // namespace

SceneSurfaces::SceneSurfaces(const CarryInputs& inputs, int64_t cache_bytes, StageContext& context)
    : images_(inputs.scene, context.scene_folder(), inputs.options.max_side_px, cache_bytes),
      sweep_images_(
          inputs.scene, context.scene_folder(), inputs.options.depth_side_px, cache_bytes),
      maker_(inputs.scene,
             images_,
             sweep_images_,
             RendererOf(inputs.scene, inputs.geometry),
             inputs.options.depth_sources,
             inputs.options.sweep,
             context.cancel()) {}

std::vector<ColoredKeyView> ReadColoredKeyViews(const CarryInputs& inputs,
                                                const SceneSurfaces& surfaces,
                                                StageContext& context,
                                                bool edits) {
  const ViewImages& images = surfaces.images();
  std::vector<ColoredKeyView> keys;
  for (const int view : inputs.key_views) {
    context.ThrowIfCancelled();
    ColoredKeyView key{view, surfaces.Of(view), {}};
    if (keys.empty()) {
      const Camera& camera = key.surfaces.rendered.camera;
      key.color = ReadKeyColor(context, camera.width, camera.height);
      ClearMasked(images.Mask(view).get(), &key.color.confidence);
      if (edits) {
        AddChannel(ReadEditedShare(context, artifact::kKeyColor, camera.width, camera.height),
                   &key.color.ab);
      }
    } else {
      key.color = CarryFromAll(keys, key.surfaces, inputs.options.carry);
      CarriedColor own = ReadAdditionalKeyColor(context, inputs.scene, view, images);
      if (key.color.ab.channels > 2) {
        AddChannel(ReadAdditionalEditedShare(context, inputs.scene, view, images), &own.ab);
      }
      FillFrom(own, &key.color);
    }
    keys.push_back(std::move(key));
  }
  return keys;
}

void CarryIntoViews(const CarryInputs& inputs,
                    const std::vector<ColoredKeyView>& keys,
                    const std::function<CarriedColor(int view)>& carry,
                    StageContext& context) {
  CarryCheckpoint done(inputs.scene, context);
  const std::vector<int> order = inputs.scene.ViewsInOrderOfTime();
  context.pool().ForEach(std::ssize(order), [&](int64_t index, int) {
    context.ThrowIfCancelled();
    const int view = order[index];
    if (done.WasDone(view)) return;
    const auto key = std::ranges::find(keys, view, &ColoredKeyView::view);
    const bool is_key = key != keys.end();
    const CarriedColor color = is_key ? key->color : carry(view);
    done.Add(view, is_key ? 1.0 : CoveredShare(color), EncodeCarriedPng(color));
  });
  WriteCoverage(inputs, done.coverage(), context);
}

}  // namespace color3d
