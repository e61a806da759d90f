#include "server/worker/live/stroke_preview.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/run_control.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/color/quick_srgb.h"
#include "core/encoder/torch_threads.h"
#include "core/image/codec.h"
#include "core/image/probe/orientation.h"
#include "core/image/quick_png.h"
#include "core/image/reduced.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/keycolor/hints/hint_layer.h"

namespace color3d {
namespace {

// Colouring at a picture's own size takes about 60 bytes per pixel.
constexpr ImageLimits kWholeLimits{.max_pixels = 25'000'000, .max_side_px = 30'000};
constexpr double kSameShape = 0.02;  // relative difference of aspect ratios
// Size at which previews of strokes above other colours are solved.
constexpr int kPreviewLayerSidePx = 500;

int64_t BytesOfPlanes(const Image& image) {
  return static_cast<int64_t>(image.data.size() * sizeof(float));
}

}  // namespace

StrokePreview::Shared StrokePreview::Luminance(const Request& request,
                                               const ReadBlob& read_blob,
                                               std::string* key) {
  const int side = request.max_side_px();
  *key = (request.image_sha256().empty() ? Sha256Hex(request.image()) : request.image_sha256()) +
         " " + std::to_string(side);
  return cache_.Get(*key, [&] {
    const std::string blob =
        request.image_sha256().empty() ? "" : read_blob(request.image_sha256());
    const std::string& bytes = request.image_sha256().empty() ? request.image() : blob;
    const ImageInfo info =
        ProbeImage(bytes, "the picture", side == 0 ? kWholeLimits : ImageLimits{});
    Prepared prepared;
    prepared.planes = LuminanceFromSrgb(side == 0 ? DecodeImage(bytes, "the picture")
                                                  : DecodeImageWithin(bytes, "the picture", side));
    const PictureSize own = OrientedSize(info, ReadOrientation(bytes));
    prepared.own_width = own.width;
    prepared.own_height = own.height;
    prepared.bytes = BytesOfPlanes(prepared.planes);
    return prepared;
  });
}

StrokePreview::Shared StrokePreview::Automatic(const Prepared& luminance, const std::string& key) {
  return cache_.Get("automatic " + key, [&] {
    // As the stage: its sums depend on the number of threads.
    SetTorchThreads(pool_.thread_count(), /*blas_threads=*/1);
    Prepared prepared;
    prepared.planes = AutomaticColorizer::Embedded()->Colorize(luminance.planes).ab;
    prepared.bytes = BytesOfPlanes(prepared.planes);
    return prepared;
  });
}

StrokePreview::Shared StrokePreview::Below(const Request& request,
                                           const Prepared& luminance,
                                           const ReadBlob& read_blob) {
  const int width = luminance.planes.width, height = luminance.planes.height;
  const std::string& sha256 = request.below_sha256();
  return cache_.Get(fmt::format("below {} {}x{}", sha256, width, height), [&] {
    const std::string bytes = read_blob(sha256);
    const PictureSize own =
        OrientedSize(ProbeImage(bytes, "the picture below the strokes"), ReadOrientation(bytes));
    const double shape =
        static_cast<double>(own.width) * luminance.own_height / own.height / luminance.own_width;
    if (std::abs(shape - 1.0) > kSameShape) {
      throw InvalidArgument(
          "the picture below the strokes has {}x{} px, the photo {}x{}; bring one of its shape",
          own.width,
          own.height,
          luminance.own_width,
          luminance.own_height);
    }
    const Image srgb =
        DecodeImageWithin(bytes, "the picture below the strokes", std::max(width, height));
    if (srgb.channels != 3) throw InvalidArgument("the picture below the strokes has no colour");
    Prepared prepared{
        ChromaOfLab(LabFromSrgb(Resize(srgb, width, height))), own.width, own.height, nullptr, 0};
    prepared.bytes = BytesOfPlanes(prepared.planes);
    return prepared;
  });
}

StrokePreview::Shared StrokePreview::Grid(
    const std::string& key, const std::function<std::shared_ptr<QuickGrid>()>& prepare) {
  return cache_.Get(key, [&] {
    Prepared prepared;
    prepared.grid = prepare();
    prepared.bytes = BytesOf(*prepared.grid);
    return prepared;
  });
}

Image StrokePreview::Spread(const Prepared& luminance,
                            const std::vector<ColorHint>& hints,
                            bool is_preview,
                            const std::string& key) {
  const Image& l = luminance.planes;
  HintPictures pictures;
  pictures.is_reduced = is_preview;
  const bool asks_automatic = std::ranges::any_of(
      hints, [](const ColorHint& hint) { return hint.fill == ColorHint::Fill::kAutomatic; });
  const Shared automatic = asks_automatic ? Automatic(luminance, key) : nullptr;
  if (automatic) pictures.automatic_ab = &automatic->planes;
  HintOptions options;
  Shared grid;
  if (is_preview) {
    grid = Grid("spread " + key, [&] { return PrepareHints(l, options, pool_); });
  }
  return KeyColorFromHints(
             l, hints, options, Control(), pictures, grid ? grid->grid.get() : nullptr)
      .ab;
}

Image StrokePreview::LayAboveColors(const Prepared& luminance,
                                    const Prepared& below,
                                    const std::vector<ColorHint>& hints,
                                    bool is_preview,
                                    const std::string& key) {
  const Image& l = luminance.planes;
  HintPictures pictures;
  pictures.is_reduced = is_preview;
  LayerOptions options;
  Shared grid;
  if (is_preview) {
    options.max_side_px = kPreviewLayerSidePx;
    grid = Grid("layer " + key, [&] { return PrepareLayer(l, options, pool_); });
  }
  Image ab = below.planes;
  LayAbove(
      LayerOfHints(l, ab, hints, options, Control(), pictures, grid ? grid->grid.get() : nullptr),
      &ab);
  return ab;
}

std::string StrokePreview::PngOf(const Image& luminance, const Image& ab, bool is_preview) {
  if (!is_preview) return EncodePng8(SrgbFromLab(JoinLab(luminance, ab)));
  std::vector<uint8_t> rgb(3 * luminance.PlaneSize());
  // In short ranges, as colours outside of the gamut take longer and lie together.
  constexpr int64_t kRangePixels = 1 << 14;
  const auto pixels = static_cast<int64_t>(luminance.PlaneSize());
  pool_.ForEach((pixels + kRangePixels - 1) / kRangePixels, [&](int64_t k, int) {
    const int64_t i = k * kRangePixels;
    QuickSrgbFromLab(luminance.Plane(0) + i,
                     ab.Plane(0) + i,
                     ab.Plane(1) + i,
                     std::min(kRangePixels, pixels - i),
                     rgb.data() + 3 * i);
  });
  return EncodeQuickPng(rgb, luminance.width, luminance.height, pool_);
}

std::string StrokePreview::Colorize(const Request& request, const ReadBlob& read_blob) {
  std::vector<ColorHint> hints;
  if (!request.points().empty()) hints = ParseHintsJson(request.points());
  std::string key;
  const Shared luminance = Luminance(request, read_blob, &key);
  const Image& l = luminance->planes;
  Shared below;
  if (request.automatic()) below = Automatic(*luminance, key);
  if (!request.below_sha256().empty()) below = Below(request, *luminance, read_blob);
  const bool is_preview = request.max_side_px() > 0;
  if (hints.empty()) return PngOf(l, below->planes, is_preview);
  hints = ScaleHints(std::move(hints),
                     static_cast<double>(l.width) / luminance->own_width,
                     static_cast<double>(l.height) / luminance->own_height);
  return PngOf(l,
               below ? LayAboveColors(*luminance, *below, hints, is_preview, key)
                     : Spread(*luminance, hints, is_preview, key),
               is_preview);
}

}  // namespace color3d
