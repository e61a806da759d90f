#include "core/keycolor/from_image.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/keycolor/picture_checks.h"

namespace color3d {

Image KeyColorFromImage(const Image& luminance, const Image& coloured) {
  if (luminance.channels != 1 || luminance.Empty()) {
    throw InvalidArgument("the key view's luminance must have 1 channel, it has " +
                          std::to_string(luminance.channels));
  }
  if (coloured.width != luminance.width || coloured.height != luminance.height) {
    throw InvalidArgument("the coloured picture is " + SizeText(coloured) + " px, the key view " +
                          SizeText(luminance) + "; save it at the key view's size");
  }
  if (coloured.channels != 3) {
    throw InvalidArgument("the coloured picture has no colour (" +
                          std::to_string(coloured.channels) + " channels, 3 are needed)");
  }
  for (float value : coloured.data) {
    if (!std::isfinite(value)) {
      throw InvalidArgument("the coloured picture holds a value that is not finite");
    }
  }
  const Image lab = LabFromSrgb(coloured);
  Image ab(lab.width, lab.height, 2);
  std::copy_n(lab.Plane(1), ab.data.size(), ab.data.begin());
  ExpectColor(lab, "the coloured picture");
  ExpectSameSubject(luminance, lab, "the coloured picture");
  return ab;
}

}  // namespace color3d
