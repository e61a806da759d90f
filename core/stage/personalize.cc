#include <cmath>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/keycolor/picture_checks.h"
#include "core/scene/view_images.h"
#include "core/stage/artifacts.h"
#include "core/stage/stages.h"
#include "core/stage/training_pictures.h"

namespace color3d {
namespace {

// The key view's colour at the size of its luminance.
Image KeyAb(const Image& luminance, StageContext& context) {
  const AbMap color = DecodeAbPng(context.ReadInput(artifact::kKeyColor), artifact::kKeyColor);
  const double height = static_cast<double>(luminance.width) / color.ab.width * color.ab.height;
  if (std::abs(height - luminance.height) > 1.0 + 0.01 * luminance.height) {
    throw InvalidArgument("key_color.png is " + SizeText(color.ab) + " px, the key view " +
                          SizeText(luminance) +
                          ": its shape is another; colour the photo that is the key view");
  }
  Image ab = Resize(color.ab, luminance.width, luminance.height);
  const ChromaLevel chroma = MeasureChroma(JoinLab(luminance, ab));
  if (chroma.IsGray()) {
    context.progress().OnWarning("the coloured key view has hardly any colour (mean chroma " +
                                 std::to_string(chroma.mean) +
                                 " Lab units), so the scene will stay grey; colour it by another "
                                 "means, e.g. hints or a picture");
  }
  return ab;
}

}  // namespace

void RunPersonalize(const ColorizerOptions& options,
                    StageContext& context,
                    const std::string& encoder) {
  options.Validate();
  const Scene scene = ReadScene(context);
  const int key = ReadKeyView(context, scene);
  const ViewImages images(scene, context.scene_folder(), options.max_side_px, 0);
  const auto luminance = images.Luminance(key);
  std::vector<TrainingPicture> pictures = {
      {"the key view", *luminance, KeyAb(*luminance, context)}};
  if (context.HasInput(artifact::kAugmentationFacts)) {
    for (TrainingPicture& picture : TrainingPicturesFrom(
             context.ReadInput(artifact::kAugmentationFacts),
             [&](const std::string& name) { return context.ReadInput(name); },
             options.max_side_px)) {
      pictures.push_back(std::move(picture));
    }
  }
  const auto colorizer = TrainColorizer(context.LoadEncoder(encoder),
                                        std::move(pictures),
                                        options,
                                        context.checkpoints(),
                                        context.progress(),
                                        context.cancel());
  context.WriteOutput(artifact::kColorizer, colorizer->Serialize());
}

}  // namespace color3d
