#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <memory>

#include "core/base/evenly.h"
#include "core/base/files.h"
#include "core/base/ordered_rounds.h"
#include "core/carry/confidence.h"
#include "core/color/lab.h"
#include "core/colorizer/personal/train_colorizer.h"
#include "core/colorizer/scene_batch.h"
#include "core/image/codec.h"
#include "core/keycolor/picture_checks.h"
#include "core/scene/photo_masks.h"
#include "core/scene/view_images.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/carry_facts.h"
#include "core/stage/formats/key_views.h"
#include "core/stage/formats/training_pictures.h"
#include "core/stage/run_stages.h"
#include "core/stage/sources/view_positions.h"

namespace color3d {
namespace {

void ExpectShapeOf(const Image& luminance, StageContext& context) {
  const ImageInfo color = ProbeImage(context.ReadInput(artifact::kKeyColor), artifact::kKeyColor);
  const double height = static_cast<double>(luminance.width) / color.width * color.height;
  if (std::abs(height - luminance.height) <= 1.0 + 0.01 * luminance.height) return;
  throw InvalidArgument(
      "{} is {}x{} px, but the key view {}: the aspect ratio differs; colour the photo that is the "
      "key view",
      artifact::kKeyColor,
      color.width,
      color.height,
      SizeText(luminance));
}

// Unpainted and masked pixels get weight 0.
TrainingPicture PictureOf(const std::string& name, const Image& luminance, CarriedColor color) {
  TrainingPicture picture{name, luminance, std::move(color.ab)};
  const auto unpainted = [](float confidence) { return confidence == 0.0f; };
  if (std::ranges::all_of(color.confidence.data, unpainted)) {
    throw InvalidArgument(
        "the painted (and unmasked) parts of {} are too fine at {} px; "
        "paint areas, or give the picture as strokes, which spread",
        name,
        SizeText(luminance));
  }
  if (std::ranges::any_of(color.confidence.data, unpainted)) {
    for (float& value : color.confidence.data) value = unpainted(value) ? 0.0f : 1.0f;
    picture.weight = std::move(color.confidence);
  }
  return picture;
}

// Returns the coloured key view.
TrainingPicture KeyPicture(const Image& luminance, const Image* mask, StageContext& context) {
  ExpectShapeOf(luminance, context);
  CarriedColor color = ReadKeyColor(context, luminance.width, luminance.height);
  ClearMasked(mask, &color.confidence);
  const ChromaLevel chroma = MeasureChroma(JoinLab(luminance, color.ab));
  if (chroma.IsGray()) {
    context.Warn(
        "the coloured key view has almost no colour (mean chroma {:.2f} Lab units), so "
        "the scene will stay grey; colour it with hints or a picture",
        chroma.mean);
  }
  return PictureOf("the key view", luminance, std::move(color));
}

// Additional key views among the inputs: the colorizer is trained on all key views jointly.
std::vector<TrainingPicture> AdditionalKeyPictures(const Scene& scene,
                                                   const ViewImages& images,
                                                   const StageContext& context) {
  std::vector<TrainingPicture> pictures;
  const std::vector<int> keys = ReadKeyViews(context, scene, AdditionalKeyViewNames(context));
  for (size_t i = 1; i < keys.size(); ++i) {
    CarriedColor color = ReadAdditionalKeyColor(context, scene, keys[i], images);
    const std::string& name = scene.views[static_cast<size_t>(keys[i])].name;
    pictures.push_back(PictureOf(name, *images.Luminance(keys[i]), std::move(color)));
  }
  return pictures;
}

// Views with carried colours for training: those of highest coverage, without the key view.
constexpr int kMaxCarriedViews = 12;
constexpr size_t kMaxViewsToLookAt = 120;  // frames of a film to consider
constexpr double kMinCoverage = 0.05;
constexpr double kCarriedShare = 0.5;  // share of the samples

std::vector<TrainingPicture> CarriedPictures(const Scene& scene,
                                             int key,
                                             const ViewImages& images,
                                             StageContext& context) {
  struct Candidate {
    std::shared_ptr<const Image> luminance;
    CarriedColor carried;
  };
  std::vector<int> views;
  for (const int view : PickEvenly(scene.TrainingViews(), kMaxViewsToLookAt)) {
    const std::string name = ViewArtifact(artifact::kCarried, scene.views[view]);
    if (view != key && context.HasInput(name)) views.push_back(view);
  }
  const auto read = [&](int64_t i) -> Candidate {
    const auto luminance = images.Luminance(views[i]);
    return {luminance,
            ReadCarried(context, scene.views[views[i]], luminance->width, luminance->height)};
  };
  std::vector<std::pair<double, TrainingPicture>> found;
  ForOrdered(&context.pool(), std::ssize(views), read, [&](int64_t i, Candidate candidate) {
    CarriedColor& carried = candidate.carried;
    const double coverage = Coverage(carried, kTrainingConfidence);
    if (coverage < kMinCoverage) return;
    for (float& value : carried.confidence.data) {
      if (value < kTrainingConfidence) value = 0.0f;
    }
    // Best ones so far, best first; ties in order.
    const auto place = std::ranges::upper_bound(
        found, coverage, std::ranges::greater(), [](const auto& other) { return other.first; });
    found.insert(place,
                 {coverage,
                  {scene.views[views[i]].name,
                   *candidate.luminance,
                   std::move(carried.ab),
                   std::move(carried.confidence)}});
    if (found.size() > kMaxCarriedViews) found.pop_back();
  });
  std::vector<TrainingPicture> pictures;
  for (auto& [coverage, picture] : found) {
    picture.share = kCarriedShare / (1.0 - kCarriedShare) / static_cast<double>(found.size());
    pictures.push_back(std::move(picture));
  }
  return pictures;
}

// min_decoder_share is one of all pixels, but the decoder has none where colours are carried.
ColorizerOptions ForOpenPixels(ColorizerOptions options, const StageContext& context) {
  if (options.min_decoder_share == 0.0) return options;  // it is always trained
  const double open = 1.0 - ReadCarryFacts(context).coverage.value_or(0.0);
  options.min_decoder_share =
      open > options.min_decoder_share ? options.min_decoder_share / open : 1.0;
  return options;
}

}  // namespace

void RunPersonalize(const ColorizerOptions& options,
                    StageContext& context,
                    const std::string& encoder,
                    const std::filesystem::path& other_colorizer) {
  options.Validate();
  if (!other_colorizer.empty()) {
    return context.WriteOutput(
        artifact::kColorizer,
        ColorizerForOtherScene(ReadFile(other_colorizer), context.LoadEncoder(encoder)));
  }
  const Scene scene = ReadScene(context);
  const int key = ReadKeyView(context, scene);
  const ViewImages images(scene, context.scene_folder(), options.max_side_px, 0);
  const auto luminance = images.Luminance(key);
  std::vector<TrainingPicture> pictures = {KeyPicture(*luminance, images.Mask(key).get(), context)};
  const ViewPositions positions(scene, context);
  pictures[0].position =
      positions.Of(key, images.WorkingCamera(key), *luminance, images.Mask(key).get());
  if (context.HasInput(artifact::kAugmentationFacts)) {
    for (TrainingPicture& picture : TrainingPicturesFrom(
             context.ReadInput(artifact::kAugmentationFacts),
             [&](const std::string& name) { return context.ReadInput(name); },
             options.max_side_px)) {
      pictures.push_back(std::move(picture));
    }
  }
  std::vector<TrainingPicture> views = AdditionalKeyPictures(scene, images, context);
  std::ranges::move(CarriedPictures(scene, key, images, context), std::back_inserter(views));
  context.pool().ForEach(std::ssize(views), [&](int64_t i, int) {
    const int view = scene.FindView(views[i].name);
    views[i].position =
        positions.Of(view, images.WorkingCamera(view), views[i].luminance, images.Mask(view).get());
  });
  std::ranges::move(views, std::back_inserter(pictures));
  SceneBatch alone(context.pool().thread_count());
  SceneBatch& batch = context.batch() != nullptr ? *context.batch() : alone;
  const auto colorizer =
      TrainColorizer(batch.SharedEncoder(encoder, [&] { return context.LoadEncoder(encoder); }),
                     std::move(pictures),
                     ForOpenPixels(options, context),
                     context.control(),
                     BatchPlace{batch, context.project()});
  context.WriteOutput(artifact::kColorizer, colorizer->Serialize());
}

}  // namespace color3d
