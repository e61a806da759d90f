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

bool IsKeyView(const CarryInputs& inputs, int view) {
  return std::ranges::find(inputs.key_views, view) != inputs.key_views.end();
}

double MeasureAgreement(const CarryInputs& inputs,
                        const CarryCheckpoint& done,
                        StageContext& context) {
  Agreement agreement;
  for (int view = 0; view < static_cast<int>(inputs.scene.views.size()); ++view) {
    context.ThrowIfCancelled();
    if (IsKeyView(inputs, view)) continue;
    AbMap map = DecodeAbPng(done.Png(view), inputs.scene.views[view].name);
    agreement.Add({std::move(map.ab), std::move(map.confidence)});
  }
  return agreement.Mean();
}

void RemoveCarried(const CarryInputs& inputs, CarryCheckpoint& done, StageContext& context) {
  for (int view = 0; view < static_cast<int>(inputs.scene.views.size()); ++view) {
    context.ThrowIfCancelled();
    if (IsKeyView(inputs, view)) continue;
    const std::string& name = inputs.scene.views[view].name;
    const Image old = DecodeAbPng(done.Png(view), name).confidence;
    done.Replace(
        view, 0.0, EncodeAbPng(Image(old.width, old.height, 2), Image(old.width, old.height, 1)));
  }
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
                    double min_agreement,
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
  const double agreement = min_agreement > 0.0 ? MeasureAgreement(inputs, done, context) : 1.0;
  if (agreement >= min_agreement) {
    WarnOfSmallCoverage(WriteCoverage(inputs, done.coverage(), context), context);
    return;
  }
  context.Warn(
      "the photos agree by only {:.2f} (at least {:.2f} is needed) where they show the same "
      "surfaces, so that the key view's colours are not carried but inferred from similarity. "
      "Causes: wrong camera positions, moving things, shiny surfaces",
      agreement,
      min_agreement);
  RemoveCarried(inputs, done, context);
  WriteCoverage(inputs, done.coverage(), context);
}

}  // namespace color3d
