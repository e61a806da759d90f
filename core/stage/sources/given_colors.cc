#include "core/stage/sources/given_colors.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/keycolor/hints/hint_map.h"

namespace color3d {
namespace {

using Source = ColorizeKeyViewOptions::Source;

constexpr int64_t kMaxHintsBytes = 1 << 26;
constexpr float kGivenAlpha = 0.5f;

// A picture that was painted on: of the photo's size.
Image ReadPainted(const std::filesystem::path& file, const Image& photo) {
  Image painted = ReadImage(file, /*keep_alpha=*/true);
  if (painted.width != photo.width || painted.height != photo.height) {
    throw InvalidArgument("the picture has {}x{} px, the photo that it corrects {}x{}",
                          painted.width,
                          painted.height,
                          photo.width,
                          photo.height);
  }
  return painted;
}

GivenColors FromMap(HintMap map, const Image& photo) {
  GivenColors colors{std::move(map.ab), Image(photo.width, photo.height, 1)};
  std::copy(map.hinted.begin(), map.hinted.end(), colors.given.data.begin());
  return colors;
}

GivenColors FromPicture(const Image& painted) {
  Image srgb(painted.width, painted.height, 3);
  std::copy_n(painted.data.begin(), srgb.data.size(), srgb.data.begin());
  GivenColors colors{ChromaOfLab(LabFromSrgb(srgb)), Image(painted.width, painted.height, 1, 1.0f)};
  for (size_t i = 0; painted.channels == 4 && i < colors.given.data.size(); ++i) {
    colors.given.data[i] = painted.Plane(3)[i] > kGivenAlpha ? 1.0f : 0.0f;
  }
  return colors;
}

GivenColors FromHints(const ColorizeKeyViewOptions& options,
                      const Image& srgb,
                      StageContext& context) {
  const auto hints = ParseHintsJson(ReadFile(options.file, kMaxHintsBytes));
  const Image labels = options.labels.empty() ? Image() : ReadImage(options.labels);
  const bool asks_automatic = std::any_of(hints.begin(), hints.end(), [](const ColorHint& hint) {
    return hint.fill == ColorHint::Fill::kAutomatic;
  });
  const Image automatic =
      asks_automatic ? AutomaticColorizer::Embedded()->Colorize(LuminanceFromSrgb(srgb)).ab
                     : Image();
  HintPictures pictures;
  if (!labels.Empty()) pictures.labels = &labels;
  if (asks_automatic) pictures.automatic_ab = &automatic;
  return FromMap(
      DrawHints(hints, pictures, srgb.width, srgb.height, context.progress(), context.cancel()),
      srgb);
}

GivenColors Read(const ColorizeKeyViewOptions& options, const Image& srgb, StageContext& context) {
  switch (options.source) {
    case Source::kStrokes:
      return FromMap(HintsOfStrokes(ReadPainted(options.file, srgb)), srgb);
    case Source::kPoints:
      return FromHints(options, srgb, context);
    case Source::kImage: {
      const Image painted = ReadPainted(options.file, srgb);
      if (painted.channels < 3) throw InvalidArgument("the picture is grey; colour it");
      return FromPicture(painted);
    }
    default:
      throw InvalidArgument(
          "a correction takes strokes, hints or a picture, no other source of colour");
  }
}

}  // namespace

GivenColors ReadGivenColors(const ColorizeKeyViewOptions& options,
                            const Image& srgb,
                            StageContext& context) {
  GivenColors colors = Read(options, srgb, context);
  if (std::none_of(colors.given.data.begin(), colors.given.data.end(), [](float v) {
        return v > 0.0f;
      })) {
    throw InvalidArgument("the correction colours no pixel");
  }
  return colors;
}

}  // namespace color3d
