#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/image/codec.h"
#include "core/keycolor/keycolor.h"

namespace color3d {
namespace {

constexpr int kCompareSidePx = 256;
constexpr double kMinCorrelation = 0.5;
constexpr double kFlatDeviation = 0.5;  // L units: below this a picture shows nothing
constexpr double kMeanChromaOfGray = 1.5;
constexpr double kPercentileChromaOfGray = 4.0;

std::string SizeOf(const Image& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height);
}

struct Moments {
  double deviation_x = 0.0;
  double deviation_y = 0.0;
  double correlation = 0.0;  // Pearson; 0 when one is constant
};

Moments Compare(const std::vector<float>& x, const std::vector<float>& y) {
  const double n = static_cast<double>(x.size());
  double mean_x = 0.0, mean_y = 0.0;
  for (size_t i = 0; i < x.size(); ++i) {
    mean_x += x[i] / n;
    mean_y += y[i] / n;
  }
  double xx = 0.0, yy = 0.0, xy = 0.0;
  for (size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean_x) * (x[i] - mean_x) / n;
    yy += (y[i] - mean_y) * (y[i] - mean_y) / n;
    xy += (x[i] - mean_x) * (y[i] - mean_y) / n;
  }
  Moments moments;
  moments.deviation_x = std::sqrt(xx);
  moments.deviation_y = std::sqrt(yy);
  if (xx > 0.0 && yy > 0.0) moments.correlation = xy / std::sqrt(xx * yy);
  return moments;
}

void ExpectSameSubject(const Image& luminance, const Image& coloured_luminance) {
  const Moments moments = Compare(FitWithin(luminance, kCompareSidePx).data,
                                  FitWithin(coloured_luminance, kCompareSidePx).data);
  const bool both_flat =
      moments.deviation_x < kFlatDeviation && moments.deviation_y < kFlatDeviation;
  if (!both_flat && !(moments.correlation > kMinCorrelation)) {
    throw InvalidArgument(
        "the coloured picture does not look like the key view (correlation of luminances " +
        std::to_string(moments.correlation) + ", needed > " + std::to_string(kMinCorrelation) +
        "); colour the photo that was chosen as key view");
  }
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
