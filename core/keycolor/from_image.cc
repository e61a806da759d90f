#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/keycolor/keycolor.h"
#include "core/keycolor/same_subject.h"

namespace color3d {
namespace {

constexpr double kMeanChromaOfGray = 1.5;
constexpr double kPercentileChromaOfGray = 4.0;

std::string SizeOf(const Image& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height);
}

void ExpectColor(const Image& ab) {
  std::vector<float> chroma(ab.PlaneSize());
  double mean = 0.0;
  for (size_t i = 0; i < chroma.size(); ++i) {
    chroma[i] = std::hypot(ab.Plane(0)[i], ab.Plane(1)[i]);
    mean += chroma[i] / static_cast<double>(chroma.size());
  }
  const size_t rank = std::min(chroma.size() - 1, chroma.size() * 99 / 100);
  std::nth_element(
      chroma.begin(), chroma.begin() + static_cast<std::ptrdiff_t>(rank), chroma.end());
  if (mean < kMeanChromaOfGray && chroma[rank] < kPercentileChromaOfGray) {
    throw InvalidArgument("the coloured picture has no colour (mean chroma " +
                          std::to_string(mean) + " Lab units); colour it first");
  }
}

}  // namespace

Image KeyColorFromImage(const Image& luminance, const Image& coloured) {
  if (luminance.channels != 1 || luminance.Empty()) {
    throw InvalidArgument("the key view's luminance must have 1 channel, it has " +
                          std::to_string(luminance.channels));
  }
  if (coloured.width != luminance.width || coloured.height != luminance.height) {
    throw InvalidArgument("the coloured picture is " + SizeOf(coloured) + " px, the key view " +
                          SizeOf(luminance) + "; save it at the key view's size");
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
  ExpectColor(ab);
  ExpectSameSubject(luminance, lab, "the coloured picture");
  return ab;
}

}  // namespace color3d
