#include "core/keycolor/picture_checks.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

constexpr int kCompareSidePx = 256;
constexpr double kMinCorrelation = 0.5;
constexpr double kMeanChromaOfGray = 1.5;
constexpr double kPercentileChromaOfGray = 4.0;
constexpr double kFlatDeviation = 0.5;  // L units: below this a picture shows nothing

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

std::vector<float> SmallLuminance(const Image& picture) {
  Image luminance(picture.width, picture.height, 1);
  std::copy_n(picture.Plane(0), luminance.data.size(), luminance.data.begin());
  return FitWithin(luminance, kCompareSidePx).data;
}

}  // namespace

void ExpectSameSubject(const Image& luminance, const Image& other, const char* what) {
  const Moments moments = Compare(SmallLuminance(luminance), SmallLuminance(other));
  const bool both_flat =
      moments.deviation_x < kFlatDeviation && moments.deviation_y < kFlatDeviation;
  if (both_flat || moments.correlation > kMinCorrelation) return;
  throw InvalidArgument(
      std::string(what) + " does not look like the key view (correlation of luminances " +
      std::to_string(moments.correlation) + ", needed > " + std::to_string(kMinCorrelation) +
      "); colour the photo that was chosen as key view");
}

void ExpectColor(const Image& lab, const char* what) {
  std::vector<float> chroma(lab.PlaneSize());
  double mean = 0.0;
  for (size_t i = 0; i < chroma.size(); ++i) {
    chroma[i] = std::hypot(lab.Plane(1)[i], lab.Plane(2)[i]);
    mean += chroma[i] / static_cast<double>(chroma.size());
  }
  const size_t rank = std::min(chroma.size() - 1, chroma.size() * 99 / 100);
  std::nth_element(
      chroma.begin(), chroma.begin() + static_cast<std::ptrdiff_t>(rank), chroma.end());
  if (mean < kMeanChromaOfGray && chroma[rank] < kPercentileChromaOfGray) {
    throw InvalidArgument(std::string(what) + " has no colour (mean chroma " +
                          std::to_string(mean) + " Lab units); colour it first");
  }
}

}  // namespace color3d
