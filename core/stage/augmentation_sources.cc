#include "core/stage/augmentation_sources.h"

#include <algorithm>
#include <cmath>

#include "core/augment/depth_filter.h"
#include "core/augment/flow_frame.h"
#include "core/augment/orbit.h"
#include "core/augment/outpaint.h"
#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/keycolor/picture_checks.h"
#include "core/splat/raster/render.h"

namespace color3d {
namespace {

constexpr char kFolder[] = "augment/";
constexpr size_t kMaxFiles = 64;
constexpr int kMinSidePx = 32;
constexpr int64_t kMaxAnswerPixels = 16'000'000;
constexpr float kMinOpacity = 0.6f;    // below it the rendered depth means nothing
constexpr double kMinCoverage = 0.25;  // of a novel view by the key view
// The film frame's camera, in median depths.
constexpr double kDriftAside = 0.05;
constexpr double kDriftForward = 0.04;

std::string Numbered(const std::string& stem, size_t index) {
  return stem + "-" + std::to_string(index + 1);
}

GeneratedPicture PictureOf(const Image& lab) {
  return {lab, Image(lab.width, lab.height, 1, 1.0f)};
}

// Lab of a picture that must be in colour and of some size.
Image CheckedLab(const Image& srgb, int max_side_px, const std::string& what) {
  if (std::min(srgb.width, srgb.height) < kMinSidePx) {
    throw InvalidArgument(what + " is " + SizeText(srgb) + " px; at least " +
                          std::to_string(kMinSidePx) + " px each way are needed");
  }
  if (srgb.channels != 3) throw InvalidArgument(what + " is grey, without any colour to learn");
  Image lab = LabFromSrgb(FitWithin(srgb, max_side_px));
  ExpectColor(lab, what.c_str());
  return lab;
}

double MedianOf(std::vector<float> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Image SolidDepth(const RenderedView& view) {
  Image depth = view.depth;
  for (size_t i = 0; i < depth.PlaneSize(); ++i) {
    if (!(view.opacity.data[i] >= kMinOpacity)) depth.data[i] = 0.0f;
  }
  return SmoothDepth(depth);
}

double Mean(const Image& image) {
  double sum = 0.0;
  for (const float value : image.data) sum += value;
  return sum / static_cast<double>(std::max<size_t>(1, image.data.size()));
}

}  // namespace

const char* AugmentationKindName(AugmentationKind kind) {
  switch (kind) {
    case AugmentationKind::kOutpaint:
      return capability::kOutpaint;
    case AugmentationKind::kAnimate:
      return capability::kAnimate;
    case AugmentationKind::kNovelView:
      return capability::kNovelView;
  }
  return "";
}

std::vector<Augmentation> AugmentationsFromFiles(int max_side_px, const StageContext& context) {
  std::vector<Augmentation> pictures;
  for (const std::string& file : ListFiles(context.scene_folder())) {
    if (!file.starts_with(kFolder)) continue;
    context.cancel().ThrowIfCancelled();
    if (!HasImageExtension(file)) {
      throw InvalidArgument(file + " is no picture (JPEG, PNG or TIFF); remove it from " + kFolder);
    }
    if (pictures.size() >= kMaxFiles) {
      throw InvalidArgument(std::string(kFolder) + " holds more than " + std::to_string(kMaxFiles) +
                            " pictures; keep the most telling ones");
    }
    try {
      const Image lab = CheckedLab(ReadImage(context.scene_folder() / file), max_side_px, file);
      pictures.push_back({Numbered("file", pictures.size()), "file", file, PictureOf(lab)});
    } catch (const Error& e) {
      throw Error(e.code(), std::string(e.what()) + "; replace or remove " + file);
    }
  }
  return pictures;
}

std::vector<Augmentation> AugmentationsFromBackend(const std::string& backend,
                                                   RemoteColorizer& remote,
                                                   const RemoteInfo& info,
                                                   AugmentationKind kind,
                                                   int count,
                                                   const KeyPicture& key,
                                                   int max_side_px,
                                                   StageContext& context) {
  const std::string name = AugmentationKindName(kind);
  RemoteGenerateRequest request;
  request.idempotency_key = context.attempt() + "/" + name;
  Image picture = key.srgb;
  const auto pixels = static_cast<double>(picture.PlaneSize());
  if (info.max_pixels > 0 && pixels > static_cast<double>(info.max_pixels)) {
    const double scale = std::sqrt(static_cast<double>(info.max_pixels) / pixels);
    picture = FitWithin(
        picture, std::max(1, static_cast<int>(scale * std::max(picture.width, picture.height))));
  }
  request.image_png = EncodePng8(picture);
  request.kind = name;
  request.samples = count;
  if (info.capabilities.contains(capability::kSeed)) request.seed = context.seed();
  const std::vector<std::string> answers =
      remote.Generate(request, context.progress(), context.cancel());
  if (answers.size() < static_cast<size_t>(count)) {
    context.progress().OnWarning("the backend '" + backend + "' made " +
                                 std::to_string(answers.size()) + " of " + std::to_string(count) +
                                 " " + name + " pictures");
  }
  std::vector<Augmentation> made;
  for (const std::string& bytes : answers) {
    const std::string what = "picture " + std::to_string(made.size() + 1) + " of its answer";
    try {
      ImageLimits limits;
      limits.max_pixels = kMaxAnswerPixels;
      ProbeImage(bytes, what, limits);
      made.push_back({Numbered(name, made.size()),
                      name,
                      "backend " + backend,
                      PictureOf(CheckedLab(DecodeImage(bytes, what), max_side_px, what))});
    } catch (const Error& e) {
      throw Error(
          ErrorCode::kFailedPrecondition,
          "the backend '" + backend + "' did not make usable " + name + " pictures: " + e.what());
    }
  }
  return made;
}

EmbeddedAugmentations::EmbeddedAugmentations(const KeyPicture& key,
                                             const Scene& scene,
                                             int key_index,
                                             std::optional<GaussianModel> model,
                                             StageContext& context)
    : key_(key), context_(context), model_(std::move(model)) {
  if (!model_) return;
  pool_ = std::make_unique<ThreadPool>(context.threads());
  const RenderedView seen = RenderView(*model_, key.camera, key.cam_from_world, *pool_);
  depth_view_ = {key.lab, SolidDepth(seen), key.camera, key.cam_from_world};
  std::vector<float> depths;
  for (const float depth : depth_view_.depth.data) {
    if (depth > 0.0f) depths.push_back(depth);
  }
  if (2 * depths.size() < depth_view_.depth.PlaneSize()) return;
  median_depth_ = MedianOf(std::move(depths));
  center_ = CenterOfAttention(scene, key_index, median_depth_);
  angle_ = OrbitAngle(scene, key_index, center_);
}

std::string EmbeddedAugmentations::Obstacle(AugmentationKind kind) const {
  const bool small = std::min(key_.lab.width, key_.lab.height) < kMinSidePx;
  if (small) return "the key view is too small (" + SizeText(key_.lab) + " px)";
  if (kind != AugmentationKind::kNovelView || median_depth_ > 0.0) return "";
  return model_ ? "the geometry fills less than half of the key view"
                : "there is no luminance geometry among the inputs";
}

std::optional<Augmentation> EmbeddedAugmentations::Make(AugmentationKind kind, int index) const {
  Augmentation made{Numbered(AugmentationKindName(kind), static_cast<size_t>(index)),
                    AugmentationKindName(kind),
                    "embedded",
                    {}};
  switch (kind) {
    case AugmentationKind::kOutpaint:
      made.picture = OutpaintQuadrant(key_.lab,
                                      static_cast<Quadrant>(index % 4),
                                      context_.seed() + static_cast<uint64_t>(index / 4),
                                      context_.cancel());
      break;
    case AugmentationKind::kAnimate:
      made.picture = Animate(index);
      break;
    case AugmentationKind::kNovelView:
      made.picture = NovelView(index);
      break;
  }
  if (Mean(made.picture.weight) < kMinCoverage) return std::nullopt;
  return made;
}

GeneratedPicture EmbeddedAugmentations::Warp(const Pose& target) const {
  RenderedView seen = RenderView(*model_, key_.camera, target, *pool_);
  TargetGeometry geometry;
  geometry.depth = SolidDepth(seen);
  geometry.luminance = std::move(seen.lab);
  return WarpToView(depth_view_, target, geometry);
}

GeneratedPicture EmbeddedAugmentations::Animate(int index) const {
  if (!(median_depth_ > 0.0)) {
    return FlowFrame(key_.lab, context_.seed() + static_cast<uint64_t>(index));
  }
  const double aside = (index % 2 == 0 ? kDriftAside : -kDriftAside) * (1 + index / 2);
  Pose drifted = key_.cam_from_world;
  drifted.translation -=
      median_depth_ * Eigen::Vector3d(aside, 0.0, kDriftForward * (1 + index / 2));
  return Warp(drifted);
}

GeneratedPicture EmbeddedAugmentations::NovelView(int index) const {
  // Right, left, above; then around the key view by the golden angle.
  constexpr double kGoldenAngle = 2.399963;
  const double turn = kGoldenAngle * index;
  double azimuth = angle_ * std::cos(turn), elevation = 0.6 * angle_ * std::sin(turn);
  if (index < 3) {
    azimuth = index == 0 ? angle_ : index == 1 ? -angle_ : 0.0;
    elevation = index == 2 ? 0.6 * angle_ : 0.0;
  }
  return Warp(OrbitPose(key_.cam_from_world, center_, azimuth, elevation));
}

}  // namespace color3d
