#include "core/stage/sources/augmentation_sources.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/augment/outpaint.h"
#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/image/reduced.h"
#include "core/keycolor/picture_checks.h"

namespace color3d {
namespace {

constexpr char kFolder[] = "augment/";
constexpr size_t kMaxFiles = 64;
constexpr int kReadSidePx = 4096;  // several times the training size
constexpr int64_t kMaxAnswerPixels = 16'000'000;

GeneratedPicture PictureOf(const Image& lab) {
  return {lab, Image(lab.width, lab.height, 1, 1.0f)};
}

// Returns a picture in Lab. Checks that it is coloured and large enough.
Image CheckedLab(const Image& srgb, int max_side_px, const std::string& what) {
  if (std::min(srgb.width, srgb.height) < kMinGeneratedSidePx) {
    throw InvalidArgument("{} is {} px; width and height must be at least {} px",
                          what,
                          SizeText(srgb),
                          kMinGeneratedSidePx);
  }
  if (srgb.channels != 3)
    throw InvalidArgument("{} is grey; the colorizer learns only from colour", what);
  Image lab = LabFromSrgb(FitWithin(srgb, max_side_px));
  ExpectColor(lab, what.c_str());
  return lab;
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

std::string AugmentationName(const std::string& kind, size_t index) {
  return fmt::format("{}-{}", kind, index + 1);
}

std::vector<Augmentation> AugmentationsFromFiles(int max_side_px, const StageContext& context) {
  std::vector<Augmentation> pictures;
  for (const std::string& file : ListFiles(context.scene_folder())) {
    if (!file.starts_with(kFolder)) continue;
    context.ThrowIfCancelled();
    if (!HasImageExtension(file)) {
      throw InvalidArgument(
          "{} is no picture ({}); remove it from {}", file, ReadableImageFormats(), kFolder);
    }
    if (pictures.size() >= kMaxFiles) {
      throw InvalidArgument("{} has more than {} pictures; keep the best ones", kFolder, kMaxFiles);
    }
    try {
      const Image lab = CheckedLab(
          ReadImageFitted(context.scene_folder() / file, kReadSidePx), max_side_px, file);
      pictures.push_back({AugmentationName("file", pictures.size()), "file", file, PictureOf(lab)});
    } catch (const Error& e) {
      throw Error(e.code(), "{}; replace or remove {}", e.what(), file);
    }
  }
  return pictures;
}

std::vector<Augmentation> AugmentationsFromBackend(const AugmentationOptions& options,
                                                   RemoteColorizer& remote,
                                                   const RemoteInfo& info,
                                                   AugmentationKind kind,
                                                   int count,
                                                   const Image& key_srgb,
                                                   StageContext& context) {
  const std::string name = AugmentationKindName(kind);
  RemoteGenerateRequest request;
  request.idempotency_key = context.attempt() + "/" + name;
  Image picture = key_srgb;
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
    context.Warn(
        "the backend '{}' made {} of {} {} pictures", options.backend, answers.size(), count, name);
  }
  std::vector<Augmentation> made;
  for (const std::string& bytes : answers) {
    const std::string what = fmt::format("picture {} of its answer", made.size() + 1);
    try {
      ImageLimits limits;
      limits.max_pixels = kMaxAnswerPixels;
      ProbeImage(bytes, what, limits);
      made.push_back({AugmentationName(name, made.size()),
                      name,
                      "backend " + options.backend,
                      PictureOf(CheckedLab(DecodeImage(bytes, what), options.max_side_px, what))});
    } catch (const Error& e) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "the backend '{}' did not make usable {} pictures: {}",
                  options.backend,
                  name,
                  e.what());
    }
  }
  return made;
}

}  // namespace color3d
