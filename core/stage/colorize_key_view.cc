#include <algorithm>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/key_photo.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/key_color_sources.h"

namespace color3d {
namespace {

constexpr float kLeastConfidence = 1.0f / 255.0f;

std::vector<std::string> NotesOnGivenPicture(const ColorizeKeyViewOptions& options) {
  using Source = ColorizeKeyViewOptions::Source;
  if (options.source != Source::kImage && options.source != Source::kEdit) return {};
  return PictureNotes(ReadFile(options.file));
}

}  // namespace

void RunColorizeKeyView(const ColorizeKeyViewOptions& options, StageContext& context) {
  const Scene scene = ReadScene(context);
  const int key = ReadKeyView(context, scene);
  KeyPhoto photo;
  photo.srgb =
      ReadKeyPhoto(context.scene_folder() / scene.views[key].image_file, context.MemoryBytes());
  photo.luminance = LuminanceFromSrgb(photo.srgb);
  const KeyColorResult result = SolveKeyColor(options, photo, context);

  nlohmann::ordered_json facts{{"source", KeyColorSourceName(options.source)},
                               {"view", scene.views[key].name}};
  facts.update(result.facts);
  for (const auto& warning : facts.value("warnings", nlohmann::ordered_json::array())) {
    context.progress().OnWarning(warning.get<std::string>());
  }
  for (const std::string& note : NotesOnGivenPicture(options)) {
    context.progress().OnWarning("the picture given for the key view " + note);
  }
  // Everything after this works on undistorted pictures.
  const ViewImages images(scene, context.scene_folder(), 0, 0);
  Image confidence = result.confidence.Empty() ? Image() : images.Undistort(key, result.confidence);
  if (options.source != ColorizeKeyViewOptions::Source::kImage) {
    // None at all says that the user left a place unpainted; what a source says is more.
    for (float& value : confidence.data) value = std::max(value, kLeastConfidence);
  }
  context.WriteOutput(artifact::kKeyColor,
                      EncodeAbPng(images.Undistort(key, result.ab), confidence));
  context.WriteOutput(artifact::kKeyViewColored,
                      EncodePng8(SrgbFromLab(JoinLab(photo.luminance, result.ab))));
  if (!result.regions.Empty()) {
    context.WriteOutput(artifact::kKeyColorRegions, EncodeJpeg(result.regions));
  }
  context.WriteOutput(artifact::kKeyColorFacts, facts.dump(1) + "\n");
}

}  // namespace color3d
