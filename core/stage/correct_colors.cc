#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifacts.h"
#include "core/stage/sources/given_colors.h"
#include "core/stage/sources/view_positions.h"
#include "core/stage/stages.h"

namespace color3d {
namespace {

constexpr size_t kMaxCorrections = 64;

// The corrections as pictures to go by, at the size of `images`: views in the order in which they
// were given.
std::vector<std::pair<int, TrainingPicture>> ReadCorrections(const CorrectColorsOptions& options,
                                                             const Scene& scene,
                                                             const ViewImages& images,
                                                             const ViewPositions& positions,
                                                             StageContext& context) {
  std::vector<std::pair<int, TrainingPicture>> pictures;
  for (const FurtherKeyView& correction : options.corrections) {
    context.cancel().ThrowIfCancelled();
    const int index = scene.FindView(correction.view);
    const View& view = scene.views[index];
    if (view.held_out) {
      throw InvalidArgument("the view {} is held out for evaluation and cannot be corrected",
                            view.name);
    }
    const GivenColors given = ReadGivenColors(
        correction.color, ReadImage(context.scene_folder() / view.image_file), context);
    const auto luminance = images.Luminance(index);
    TrainingPicture picture{view.name, *luminance, images.Undistort(index, given.ab)};
    picture.weight = images.Undistort(index, given.given);
    picture.position = positions.Of(index, images.WorkingCamera(index), *luminance);
    pictures.emplace_back(index, std::move(picture));
  }
  return pictures;
}

// What the view has without corrections; the key view has the user's own colours.
Image ColorsOf(int index, int key, const Scene& scene, const Image& size, StageContext& context) {
  if (index != key) return ReadViewAb(context, scene.views[index], size.width, size.height);
  const AbMap color = DecodeAbPng(context.ReadInput(artifact::kKeyColor), artifact::kKeyColor);
  return Resize(color.ab, size.width, size.height);
}

void MixIn(const Image& ab, const Image& share, Image* colors) {
  for (int c = 0; c < 2; ++c) {
    for (size_t i = 0; i < share.data.size(); ++i) {
      float& value = colors->Plane(c)[i];
      value += share.data[i] * (ab.Plane(c)[i] - value);
    }
  }
}

// What was corrected is the user's: seen.
void CountAsSeen(const Image& share, Image* provenance) {
  for (size_t i = 0; i < share.data.size(); ++i) {
    for (int c = 0; c < 3; ++c) provenance->Plane(c)[i] *= 1.0f - share.data[i];
    provenance->Plane(1)[i] += share.data[i];
  }
}

}  // namespace

void CorrectColorsOptions::Validate() const {
  if (corrections.empty()) throw InvalidArgument("there is nothing to correct");
  if (corrections.size() > kMaxCorrections) {
    throw InvalidArgument(
        "{} corrections were given; at most {} are taken", corrections.size(), kMaxCorrections);
  }
}

void RunCorrectColors(const CorrectColorsOptions& options,
                      StageContext& context,
                      const std::string& encoder) {
  options.Validate();
  const Scene scene = ReadScene(context);
  const int key = ReadKeyView(context, scene);
  const ViewImages images(
      scene, context.scene_folder(), ColoredSide(context, scene.views[key]), 0);
  const ViewPositions positions(scene, context);
  const auto corrections = ReadCorrections(options, scene, images, positions, context);
  std::vector<TrainingPicture> pictures;
  for (const auto& [view, picture] : corrections) pictures.push_back(picture);
  // Views are corrected side by side, each on one thread.
  const auto corrector = LoadColorizer(context.ReadInput(artifact::kColorizer),
                                       context.LoadEncoder(encoder),
                                       /*threads=*/1)
                             ->Correct(pictures);
  const auto total = static_cast<int64_t>(scene.views.size());
  std::mutex outputs;
  int64_t done = 0;
  double changed = 0.0;
  context.pool().ForEach(total, [&](int64_t index, int) {
    context.cancel().ThrowIfCancelled();
    const auto number = static_cast<int>(index);
    const View& view = scene.views[index];
    const auto luminance = images.Luminance(number);
    Image ab = ColorsOf(number, key, scene, *luminance, context);
    Image provenance = ReadProvenance(context, view, luminance->width, luminance->height);
    CorrectedColor corrected = corrector->Predict(
        *luminance, {{}, positions.Of(number, images.WorkingCamera(number), *luminance)});
    MixIn(corrected.ab, corrected.share, &ab);
    double sum = 0.0;
    for (const float share : corrected.share.data) sum += share;
    for (const auto& [at, picture] : corrections) {
      if (at == number) MixIn(picture.ab, picture.weight, &ab);
    }
    if (!provenance.Empty()) CountAsSeen(corrected.share, &provenance);
    const std::string ab_png = EncodeAbPng(ab);
    const std::string provenance_png = provenance.Empty() ? "" : EncodePng8(provenance);
    const std::lock_guard lock(outputs);
    changed += sum / static_cast<double>(corrected.share.data.size());
    context.WriteOutput(ViewArtifact(artifact::kCorrectedAb, view, ".png"), ab_png);
    if (!provenance.Empty()) {
      context.WriteOutput(ViewArtifact(artifact::kCorrectedProvenance, view, ".png"),
                          provenance_png);
    }
    context.progress().OnProgress(++done, total, "correcting " + view.name);
  });
  context.progress().OnError(0, "corrected_share", changed / static_cast<double>(total));
}

}  // namespace color3d
