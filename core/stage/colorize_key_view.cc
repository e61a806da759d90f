#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/stage/artifacts.h"
#include "core/stage/stages.h"

namespace color3d {
namespace {

Image SolveKeyColor(const ColorizeKeyViewOptions& options,
                    const Image& luminance,
                    StageContext& context) {
  using Source = ColorizeKeyViewOptions::Source;
  if (options.source == Source::kImage) {
    return KeyColorFromImage(luminance, ReadImage(options.file));
  }
  HintSolution solution;
  if (options.source == Source::kStrokes) {
    solution = KeyColorFromStrokes(luminance,
                                   ReadImage(options.file, /*keep_alpha=*/true),
                                   options.hints,
                                   context.progress(),
                                   context.cancel());
  } else {
    solution = KeyColorFromHints(luminance,
                                 ParseHintsJson(ReadFile(options.file, 1 << 26)),
                                 options.hints,
                                 context.progress(),
                                 context.cancel());
  }
  return std::move(solution.ab);
}

}  // namespace

void RunColorizeKeyView(const ColorizeKeyViewOptions& options, StageContext& context) {
  const Scene scene = ReadScene(context);
  const int key = ReadKeyView(context, scene);
  const Image luminance =
      LuminanceFromSrgb(ReadImage(context.scene_folder() / scene.views[key].image_file));
  const Image ab = SolveKeyColor(options, luminance, context);
  // Everything after this works on undistorted pictures.
  const ViewImages images(scene, context.scene_folder(), 0, 0);
  context.WriteOutput(artifact::kKeyColor, EncodeAbPng(images.Undistort(key, ab)));
  context.WriteOutput(artifact::kKeyViewColored, EncodePng8(SrgbFromLab(JoinLab(luminance, ab))));
}

}  // namespace color3d
