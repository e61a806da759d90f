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

// Only key views keep their colours.
void RemoveCarried(const CarryInputs& inputs, CarryCheckpoint& done, StageContext& context) {
  for (int view = 0; view < static_cast<int>(inputs.scene.views.size()); ++view) {
    context.ThrowIfCancelled();
    if (inputs.IsKeyView(view)) continue;
    const ImageInfo size = ProbeImage(done.Png(view), inputs.scene.views[view].name);
    done.Replace(view,
                 0.0,
                 EncodeAbPng(Image(size.width, size.height, 2), Image(size.width, size.height, 1)));
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
        AddEditedShare(ReadEditedShare(context, artifact::kKeyColor, camera.width, camera.height),
                       &key.color.ab);
      }
    } else {
      key.color = CarryFromAll(keys, key.surfaces, inputs.options.carry);
      CarriedColor own = ReadAdditionalKeyColor(context, inputs.scene, view, images);
      if (key.color.ab.channels > 2) {
        AddEditedShare(ReadAdditionalEditedShare(context, inputs.scene, view, images), &own.ab);
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
  std::vector<Agreement> agreements(inputs.scene.views.size());  // none of key views
  context.pool().ForEach(std::ssize(order), [&](int64_t index, int) {
    context.ThrowIfCancelled();
    const int view = order[index];
    const auto key = std::ranges::find(keys, view, &ColoredKeyView::view);
    const bool is_key = key != keys.end();
    if (done.WasDone(view)) {
      if (!is_key) {
        const std::string& name = inputs.scene.views[view].name;
        agreements[view] = AgreementOf(DecodeAbPng(done.Png(view), name).confidence);
      }
      return;
    }
    const CarriedColor color = is_key ? key->color : carry(view);
    if (!is_key) agreements[view] = AgreementOf(color.confidence);
    done.Add(view, is_key ? 1.0 : CoveredShare(color), EncodeCarriedPng(color));
  });
  const double agreement = MeanAgreement(agreements);
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
