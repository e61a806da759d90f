#include "core/keycolor/from_image.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/color/lab_planes.h"
#include "core/image/image_checks.h"
#include "core/keycolor/picture_checks.h"

namespace color3d {
namespace {

constexpr float kPaintedAlpha = 0.5f;

// Returns 1 where the picture is opaque, or an empty image if it is opaque everywhere.
Image OpaquePart(const Image& colored) {
  if (colored.channels < 4) return {};
  Image opaque(colored.width, colored.height, 1);
  size_t count = 0;
  for (size_t i = 0; i < opaque.data.size(); ++i) {
    opaque.data[i] = colored.Plane(3)[i] > kPaintedAlpha ? 1.0f : 0.0f;
    count += opaque.data[i] > 0.0f ? 1 : 0;
  }
  if (count == 0) throw InvalidArgument("the coloured picture is fully transparent; paint on it");
  return count < opaque.data.size() ? opaque : Image();
}

Image WithoutAlpha(const Image& colored) {
  Image srgb(colored.width, colored.height, 3);
  std::copy_n(colored.data.begin(), srgb.data.size(), srgb.data.begin());
  return srgb;
}

}  // namespace

PaintedColor KeyColorFromImage(const Image& luminance, const Image& colored) {
  RequireLuminance(luminance, "the colouring of the key view");
  if (colored.width != luminance.width || colored.height != luminance.height) {
    throw InvalidArgument(
        "the coloured picture is {} px, but the key view {}; save it at the size of the key view",
        SizeText(colored),
        SizeText(luminance));
  }
  if (colored.channels < 3) {
    throw InvalidArgument("the coloured picture has no colour ({} channels, 3 are needed)",
                          colored.channels);
  }
  if (!IsFinite(colored)) {
    throw InvalidArgument("the coloured picture has a value that is not finite");
  }
  PaintedColor color;
  color.painted = OpaquePart(colored);
  Image lab = LabFromSrgb(WithoutAlpha(colored));
  // Unpainted pixels take the luminance of the photo, without colour.
  for (size_t i = 0; i < color.painted.data.size(); ++i) {
    if (color.painted.data[i] > 0.0f) continue;
    lab.Plane(0)[i] = luminance.data[i];
    lab.Plane(1)[i] = lab.Plane(2)[i] = 0.0f;
  }
  // A painted part may be grey on purpose.
  if (color.painted.Empty()) ExpectColor(lab, "the coloured picture");
  ExpectSameSubject(luminance, lab, "the coloured picture");
  color.ab = ChromaOfLab(lab);
  return color;
}

}  // namespace color3d
