#include "core/stage/sources/further_colors.h"

#include "core/color/lab.h"
#include "core/image/fill_holes.h"
#include "core/scene/key_photo.h"
#include "core/scene/photo_masks.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/sources/given_colors.h"
#include "core/stage/sources/key_color_sources.h"

namespace color3d {

int ViewOfFurther(const FurtherKeyView& further, const Scene& scene) {
  const int view = scene.FindView(further.view);
  if (scene.views[view].held_out) {
    throw InvalidArgument("the view {} is held out for evaluation and cannot be a key view",
                          scene.views[view].name);
  }
  return view;
}

CarriedColor ColorOfFurther(const FurtherKeyView& further,
                            int view,
                            const Scene& scene,
                            const ViewImages& images,
                            StageContext& context) {
  KeyPhoto photo;
  photo.srgb =
      ReadKeyPhoto(context.scene_folder() / scene.views[view].image_file, context.MemoryBytes());
  photo.luminance = LuminanceFromSrgb(photo.srgb);
  const KeyColorResult result = SolveKeyColor(further.color, photo, context);
  CarriedColor color;
  if (result.confidence.Empty()) {
    color.ab = images.Undistort(view, result.ab);
    color.confidence = Image(color.ab.width, color.ab.height, 1, 1.0f);
  } else {
    color = UndistortGiven(result.ab, result.confidence, view, images);
    // Colours are carried from between pixels, too.
    FillHoles(color.confidence, &color.ab);
  }
  ClearMasked(images.Mask(view).get(), &color.confidence);
  return color;
}

}  // namespace color3d
