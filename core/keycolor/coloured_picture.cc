#include "core/keycolor/coloured_picture.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/image/codec.h"

namespace color3d {
namespace {

constexpr int kCompareSidePx = 256;
constexpr double kFlatDeviation = 0.5;  // L units: below this a picture shows nothing

}  // namespace

std::string SizeText(const Image& image) {
  return std::to_string(image.width) + "x" + std::to_string(image.height);
}

LuminanceAgreement CompareLuminance(const Image& first, const Image& second) {
  const std::vector<float> x = FitWithin(first, kCompareSidePx).data;
  const std::vector<float> y = FitWithin(second, kCompareSidePx).data;
  const double n = static_cast<double>(x.size());
  double mean_x = 0.0, mean_y = 0.0;
  for (size_t i = 0; i < x.size(); ++i) {
    mean_x += x[i] / n;
    mean_y += y[i] / n;
  }
  LuminanceAgreement agreement;
  double xx = 0.0, yy = 0.0, xy = 0.0;
  for (size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean_x) * (x[i] - mean_x) / n;
    yy += (y[i] - mean_y) * (y[i] - mean_y) / n;
    xy += (x[i] - mean_x) * (y[i] - mean_y) / n;
    agreement.mean_difference += std::abs(static_cast<double>(x[i]) - y[i]) / n;
  }
  if (xx > 0.0 && yy > 0.0) agreement.correlation = xy / std::sqrt(xx * yy);
  agreement.both_flat = std::sqrt(xx) < kFlatDeviation && std::sqrt(yy) < kFlatDeviation;
  return agreement;
}

ChromaLevel MeasureChroma(const Image& ab) {
  std::vector<float> chroma(ab.PlaneSize());
  ChromaLevel level;
  for (size_t i = 0; i < chroma.size(); ++i) {
    chroma[i] = std::hypot(ab.Plane(0)[i], ab.Plane(1)[i]);
    level.mean += chroma[i] / static_cast<double>(chroma.size());
  }
  const size_t rank = std::min(chroma.size() - 1, chroma.size() * 99 / 100);
  std::nth_element(
      chroma.begin(), chroma.begin() + static_cast<std::ptrdiff_t>(rank), chroma.end());
  level.percentile99 = chroma[rank];
  return level;
}

}  // namespace color3d
