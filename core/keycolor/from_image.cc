#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/keycolor/coloured_picture.h"
#include "core/keycolor/keycolor.h"

namespace color3d {
namespace {

void ExpectSameSubject(const Image& luminance, const Image& coloured_luminance) {
  const LuminanceAgreement agreement = CompareLuminance(luminance, coloured_luminance);
  if (agreement.SameSubject()) return;
  throw InvalidArgument(
      "the coloured picture does not look like the key view (correlation of luminances " +
      std::to_string(agreement.correlation) + ", needed > " +
      std::to_string(LuminanceAgreement::kMinCorrelation) +
      "); colour the photo that was chosen as key view");
}

void ExpectColor(const Image& ab) {
  const ChromaLevel chroma = MeasureChroma(ab);
  if (chroma.IsGray()) {
    throw InvalidArgument("the coloured picture has no colour (mean chroma " +
                          std::to_string(chroma.mean) + " Lab units); colour it first");
  }
}

}  // namespace

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
  Image l(lab.width, lab.height, 1);
  Image ab(lab.width, lab.height, 2);
  std::copy_n(lab.data.begin(), l.data.size(), l.data.begin());
  std::copy_n(lab.data.begin() + static_cast<std::ptrdiff_t>(l.data.size()),
              ab.data.size(),
              ab.data.begin());
  ExpectColor(ab);
  ExpectSameSubject(luminance, l);
  return ab;
}

}  // namespace color3d
