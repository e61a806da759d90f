#include "core/stage/sources/given_colors.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/base/files.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/codec.h"
#include "core/image/weighted_resize.h"
#include "core/keycolor/automatic/automatic.h"
#include "core/keycolor/from_image.h"
#include "core/keycolor/hints/hint_map.h"
#include "core/keycolor/picture_checks.h"
#include "core/stage/context/stage_context.h"

namespace color3d {
namespace {

constexpr int64_t kMaxHintsBytes = 1 << 26;
constexpr float kGivenAlpha = 0.5f;
constexpr double kSameShape = 0.01;  // relative difference of aspect ratios
constexpr float kPaintedOver =
    6.0f;  // Lab units; smaller changes may be rounding of dark 8-bit colours

bool HasTransparentPart(const Image& picture) {
  if (picture.channels != 4) return false;
  return std::any_of(picture.Plane(3), picture.Plane(3) + picture.PlaneSize(), [](float alpha) {
    return alpha <= kGivenAlpha;
  });
}

Image Channels(const Image& picture, int first, int count) {
  Image part(picture.width, picture.height, count);
  std::copy_n(picture.Plane(first), part.data.size(), part.data.begin());
  return part;
}

// Reads a painted picture and resizes it to the photo.
Image ReadPainted(const std::filesystem::path& file, const Image& photo) {
  Image painted = ReadImage(file, /*keep_alpha=*/true);
  const int width = photo.width, height = photo.height;
  if (painted.width == width && painted.height == height) return painted;
  const double shape = static_cast<double>(painted.width) * height / painted.height / width;
  if (!HasTransparentPart(painted) || std::abs(shape - 1.0) > kSameShape) {
    throw InvalidArgument(
        "the picture has {} px, the photo that it corrects {}; paint at the photo's size, or on a "
        "transparent layer over a picture of its shape",
        SizeText(painted),
        SizeText(photo));
  }
  const Image alpha = Channels(painted, 3, 1);
  const Image color = ResizeWeighted(Channels(painted, 0, 3), alpha, width, height);
  const Image small_alpha = Resize(alpha, width, height);
  Image fitted(width, height, 4);
  std::ranges::copy(color.data, fitted.data.begin());
  std::ranges::copy(small_alpha.data, fitted.Plane(3));
  return fitted;
}

GivenColors FromMap(HintMap map, const Image& photo) {
  GivenColors colors{std::move(map.ab), Image(photo.width, photo.height, 1)};
  std::ranges::copy(map.hinted, colors.given.data.begin());
  return colors;
}

GivenColors FromPicture(const Image& painted, const Image& srgb, const Image& current_ab) {
  PaintedColor color = KeyColorFromImage(LuminanceFromSrgb(srgb), painted);
  GivenColors colors{std::move(color.ab), std::move(color.painted)};
  if (!colors.given.Empty()) return colors;
  const Image before = ChromaOfLab(LabFromSrgb(PaintablePhoto(srgb, current_ab)));
  colors.given = Image(srgb.width, srgb.height, 1);
  for (size_t i = 0; i < colors.given.data.size(); ++i) {
    const float a = colors.ab.Plane(0)[i] - before.Plane(0)[i];
    const float b = colors.ab.Plane(1)[i] - before.Plane(1)[i];
    colors.given.data[i] = a * a + b * b > kPaintedOver * kPaintedOver ? 1.0f : 0.0f;
  }
  return colors;
}

GivenColors FromHints(const PaintedColors& painted, const Image& srgb, StageContext& context) {
  const auto hints = ParseHintsJson(ReadFile(painted.file, kMaxHintsBytes));
  const Image labels = painted.labels.empty() ? Image() : ReadStoredValues(painted.labels);
  const bool asks_automatic = std::ranges::any_of(
      hints, [](const ColorHint& hint) { return hint.fill == ColorHint::Fill::kAutomatic; });
  const Image automatic = asks_automatic
                              ? AutomaticColorizer::Embedded()->Colorize(LuminanceFromSrgb(srgb)).ab
                              : Image();
  HintPictures pictures;
  if (!labels.Empty()) pictures.labels = &labels;
  if (asks_automatic) pictures.automatic_ab = &automatic;
  GivenColors colors = FromMap(
      DrawHints(hints, pictures, srgb.width, srgb.height, context.progress(), context.cancel()),
      srgb);
  colors.reach = std::ranges::max_element(hints, {}, &ColorHint::reach)->reach;
  return colors;
}

GivenColors Read(const PaintedColors& painted,
                 const Image& srgb,
                 const Image& current_ab,
                 StageContext& context) {
  switch (painted.kind) {
    case PaintedColors::Kind::kStrokes:
      return FromMap(HintsFromStrokes(ReadPainted(painted.file, srgb)), srgb);
    case PaintedColors::Kind::kPoints:
      return FromHints(painted, srgb, context);
    case PaintedColors::Kind::kPicture:
      break;
  }
  return FromPicture(ReadPainted(painted.file, srgb), srgb, current_ab);
}

}  // namespace

Image PaintablePhoto(const Image& srgb, const Image& ab) {
  const Image luminance = LuminanceFromSrgb(srgb);
  return SrgbFromLab(JoinLab(luminance, Resize(ab, srgb.width, srgb.height)));
}

GivenColors ReadGivenColors(const PaintedColors& painted,
                            const Image& srgb,
                            const Image& current_ab,
                            StageContext& context) {
  GivenColors colors = Read(painted, srgb, current_ab, context);
  const auto given = [](float value) { return value > 0.0f; };
  if (std::ranges::none_of(colors.given.data, given)) {
    throw InvalidArgument("it changes no pixel of the photo");
  }
  return colors;
}

void MixIn(const Image& ab, const Image& share, Image* colors) {
  for (int c = 0; c < 2; ++c) {
    for (size_t i = 0; i < share.data.size(); ++i) {
      float& value = colors->Plane(c)[i];
      value += share.data[i] * (ab.Plane(c)[i] - value);
    }
  }
}

CarriedColor UndistortGivenColors(const Image& ab,
                                  const Image& given,
                                  int view,
                                  const ViewImages& images) {
  Image weighted = ab;
  for (int c = 0; c < 2; ++c) {
    for (size_t i = 0; i < given.data.size(); ++i) weighted.Plane(c)[i] *= given.data[i];
  }
  CarriedColor color{images.Undistort(view, weighted), images.Undistort(view, given)};
  for (int c = 0; c < 2; ++c) {
    for (size_t i = 0; i < color.confidence.data.size(); ++i) {
      const float share = color.confidence.data[i];
      if (share > 0.0f) color.ab.Plane(c)[i] /= share;
    }
  }
  return color;
}

}  // namespace color3d
