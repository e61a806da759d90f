#include <fmt/format.h>

#include <memory>
#include <utility>

#include "core/scene/photo_masks.h"
#include "core/scene/view_images.h"
#include "core/stage/carry/automatic_colors.h"
#include "core/stage/carry/carry_by_kind.h"
#include "core/stage/carry/carry_results.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/carry_checkpoint.h"
#include "core/stage/formats/edited_share.h"
#include "core/stage/formats/key_views.h"
#include "core/stage/sources/picture_carry.h"

namespace color3d {
namespace {

bool IsEdit(const StageContext& context) {
  return !ReadEditedShare(context, artifact::kKeyColor, 1, 1).Empty();
}

// Colours of a key view, with the edited share if the chosen key view is an edit.
CarriedColor KeyColor(const CarryInputs& inputs,
                      int view,
                      const ViewImages& images,
                      const StageContext& context) {
  CarriedColor color;
  Image edited;
  if (view == inputs.key_views.front()) {
    const Camera camera = images.WorkingCamera(view);
    color = ReadKeyColor(context, camera.width, camera.height);
    ClearMasked(images.Mask(view).get(), &color.confidence);
    edited = ReadEditedShare(context, artifact::kKeyColor, camera.width, camera.height);
  } else {
    color = ReadAdditionalKeyColor(context, inputs.scene, view, images);
    if (IsEdit(context)) edited = ReadAdditionalEditedShare(context, inputs.scene, view, images);
  }
  AddEditedShare(edited, &color.ab);
  return color;
}

}  // namespace

void CarryPictures(const CarryInputs& inputs, StageContext& context) {
  const ViewImages images(inputs.scene, context.scene_folder(), inputs.options.max_side_px);
  const int count = static_cast<int>(inputs.scene.views.size());
  CarryCheckpoint done(inputs.scene, context);
  PictureCarry carry(images, count, IsEdit(context) ? 3 : 2, inputs.options.film, context);
  for (const int view : inputs.key_views) {
    carry.Set(view, KeyColor(inputs, view, images, context));
  }
  carry.Run(inputs.key_views, [&](size_t pictures) {
    done.ReportProgress(fmt::format("looking for the same things in {} photos", pictures));
  });
  const std::shared_ptr<const AutomaticColorizer> colorizer = ColorizerOfKeyView(context);
  for (int view = 0; view < count; ++view) {
    context.ThrowIfCancelled();
    if (done.WasDone(view)) continue;
    CarriedColor color = carry.ColorOf(view);
    if (colorizer && !inputs.IsKeyView(view)) {
      AutomaticColor guess = colorizer->Colorize(*images.Luminance(view));
      FillFrom({std::move(guess.ab), std::move(guess.confidence)}, &color);
    }
    done.Add(view, CoveredShare(color), EncodeCarriedPng(color));
  }
  WarnOfSmallCoverage(WriteCoverage(inputs, done.coverage(), context), context);
}

}  // namespace color3d
