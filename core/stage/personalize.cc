#include "core/color/lab.h"
#include "core/colorizer/scene_batch.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/stage/artifacts.h"
#include "core/stage/stages.h"

namespace color3d {
namespace {

constexpr std::string_view kAbEnding = ".ab.png";
// All augmented samples together are drawn as often as the key view.
constexpr double kSamplesShare = 1.0;

Image DecodeInput(const StageContext& context, const std::string& name) {
  return DecodeImage(context.ReadInput(name), name);
}

// augmentations/NAME.png with NAME.ab.png and NAME.weight.png, as generate_augmentations leaves
// them; none when that stage did not run.
std::vector<TrainingPicture> ReadAugmentations(const StageContext& context) {
  std::vector<TrainingPicture> pictures;
  for (const std::string& name : context.InputsBelow("augmentations/")) {
    if (!name.ends_with(kAbEnding)) continue;
    const std::string stem = name.substr(0, name.size() - kAbEnding.size());
    TrainingPicture picture;
    picture.name = stem;
    picture.ab = DecodeAbPng(context.ReadInput(name), name).ab;
    picture.luminance = LuminanceFromSrgb(DecodeInput(context, stem + ".png"));
    const std::string weight = stem + ".weight.png";
    if (context.HasInput(weight)) picture.weight = DecodeInput(context, weight);
    pictures.push_back(std::move(picture));
  }
  for (TrainingPicture& picture : pictures) {
    picture.share = kSamplesShare / static_cast<double>(pictures.size());
  }
  return pictures;
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
  const AbMap color = DecodeAbPng(context.ReadInput(artifact::kKeyColor), artifact::kKeyColor);
  std::vector<TrainingPicture> pictures = ReadAugmentations(context);
  pictures.insert(
      pictures.begin(),
      {"the key view", *luminance, Resize(color.ab, luminance->width, luminance->height)});
  SceneBatch alone(options.threads);
  SceneBatch& batch = context.batch() != nullptr ? *context.batch() : alone;
  const auto colorizer =
      TrainColorizer(batch.SharedEncoder(encoder, [&] { return context.LoadEncoder(encoder); }),
                     std::move(pictures),
                     options,
                     context.checkpoints(),
                     context.progress(),
                     context.cancel(),
                     batch,
                     context.project());
  context.WriteOutput(artifact::kColorizer, colorizer->Serialize());
}

}  // namespace color3d
