#include "core/keycolor/from_image.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/keycolor/picture_checks.h"

namespace color3d {

Image KeyColorFromImage(const Image& luminance, const Image& colored) {
  if (luminance.channels != 1 || luminance.Empty()) {
    throw InvalidArgument("the key view's luminance must have 1 channel, it has {}",
                          luminance.channels);
  }
  if (colored.width != luminance.width || colored.height != luminance.height) {
    throw InvalidArgument(
        "the coloured picture is {} px, the key view {}; save it at the key view's size",
        SizeText(colored),
        SizeText(luminance));
  }
  if (colored.channels != 3) {
    throw InvalidArgument("the coloured picture has no colour ({} channels, 3 are needed)",
                          colored.channels);
  }
  for (float value : colored.data) {
    if (!std::isfinite(value)) {
      throw InvalidArgument("the coloured picture holds a value that is not finite");
    }
  }
  const Image lab = LabFromSrgb(colored);
  Image ab(lab.width, lab.height, 2);
  std::copy_n(lab.Plane(1), ab.data.size(), ab.data.begin());
  ExpectColor(lab, "the coloured picture");
  ExpectSameSubject(luminance, lab, "the coloured picture");
  return ab;
}

}  // namespace color3d
