#include <algorithm>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/keycolor/recolor.h"
#include "core/scene/key_photo.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/edited_share.h"
#include "core/stage/formats/key_views.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/given_colors.h"
#include "core/stage/sources/key_color_sources.h"

namespace color3d {
namespace {

constexpr float kLeastConfidence = 1.0f / 255.0f;

std::vector<std::string> NotesOnGivenPicture(const ColorizeKeyViewOptions& options) {
  using Source = ColorizeKeyViewOptions::Source;
  if (options.source != Source::kImage && options.source != Source::kEdit) return {};
  return PictureNotes(ReadFile(options.file));
}

// Edited share of an edit, undistorted.
Image EditedShareOf(const KeyPhoto& photo,
                    const Image& edited_ab,
                    int view,
                    const ViewImages& images) {
  const Image lab = LabFromSrgb(photo.srgb);
  Image original(lab.width, lab.height, 2);
  std::copy_n(lab.Plane(1), original.data.size(), original.data.begin());
  return images.Undistort(view, EditedShare(original, edited_ab));
}

}  // namespace

void RunColorizeKeyView(const ColorizeKeyViewOptions& options, StageContext& context) {
  const Scene scene = ReadScene(context);
  const bool additional = !options.view.empty();
  const int key =
      additional ? FindAdditionalKeyView(scene, options.view) : ReadKeyView(context, scene);
  KeyPhoto photo;
  photo.srgb =
      ReadKeyPhoto(context.scene_folder() / scene.views[key].image_file, context.MemoryBytes());
  photo.luminance = LuminanceFromSrgb(photo.srgb);
  const KeyColorResult result = SolveKeyColor(options, photo, context);

  nlohmann::ordered_json facts{{"source", KeyColorSourceName(options.source)},
                               {"view", scene.views[key].name}};
  facts.update(result.facts);
  for (const auto& warning : facts.value("warnings", nlohmann::ordered_json::array())) {
    context.Warn(warning.get<std::string>());
  }
  for (const std::string& note : NotesOnGivenPicture(options)) {
    context.Warn("the picture given for the key view " + note);
  }
  // Everything after this works on undistorted pictures.
  const ViewImages images(scene, context.scene_folder(), 0, 0);
  CarriedColor color;
  if (result.confidence.Empty()) {
    color.ab = images.Undistort(key, result.ab);
  } else if (additional) {
    color = UndistortGivenColors(result.ab, result.confidence, key, images);
  } else {
    color = {images.Undistort(key, result.ab), images.Undistort(key, result.confidence)};
  }
  if (options.source != ColorizeKeyViewOptions::Source::kImage) {
    // Confidence 0 marks places that the user left unpainted.
    for (float& value : color.confidence.data) value = std::max(value, kLeastConfidence);
  }
  if (options.source == ColorizeKeyViewOptions::Source::kEdit) {
    AddEditedShare(EditedShareOf(photo, result.ab, key, images), &color.ab);
    if (color.confidence.Empty())
      color.confidence = Image(color.ab.width, color.ab.height, 1, 1.0f);
  }
  context.WriteOutput(artifact::kKeyColor, EncodeCarriedPng(color));
  context.WriteOutput(artifact::kKeyViewColored,
                      EncodePng8(SrgbFromLab(JoinLab(photo.luminance, result.ab))));
  if (!result.regions.Empty()) {
    context.WriteOutput(artifact::kKeyColorRegions, EncodeJpeg(result.regions));
  }
  context.WriteOutput(artifact::kKeyColorFacts, facts.dump(1) + "\n");
}

}  // namespace color3d
