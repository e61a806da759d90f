#include "core/keycolor/picture_checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/base/error.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

constexpr int kCompareSidePx = 256;
constexpr double kFlatDeviation = 0.5;  // L units; deviation below which a picture is flat

std::vector<float> SmallLuminance(const Image& picture) {
  Image luminance(picture.width, picture.height, 1);
  std::copy_n(picture.Plane(0), luminance.data.size(), luminance.data.begin());
  return FitWithin(luminance, kCompareSidePx).data;
}

}  // namespace

std::string SizeText(const Image& image) { return fmt::format("{}x{}", image.width, image.height); }

LuminanceAgreement CompareLuminance(const Image& first, const Image& second) {
  const std::vector<float> x = SmallLuminance(first);
  const std::vector<float> y = SmallLuminance(second);
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

ChromaLevel MeasureChroma(const Image& lab) {
  std::vector<float> chroma(lab.PlaneSize());
  ChromaLevel level;
  for (size_t i = 0; i < chroma.size(); ++i) {
    chroma[i] = std::hypot(lab.Plane(1)[i], lab.Plane(2)[i]);
    level.mean += chroma[i] / static_cast<double>(chroma.size());
  }
  const size_t rank = std::min(chroma.size() - 1, chroma.size() * 99 / 100);
  std::nth_element(
      chroma.begin(), chroma.begin() + static_cast<std::ptrdiff_t>(rank), chroma.end());
  level.percentile99 = chroma[rank];
  return level;
}

void ExpectSameSubject(const Image& luminance, const Image& other, const char* what) {
  const LuminanceAgreement agreement = CompareLuminance(luminance, other);
  if (agreement.SameSubject()) return;
  throw InvalidArgument(
      "{} does not resemble the key view (correlation of luminances {:.3g}, required > {}); colour "
      "the "
      "photo that was chosen as key view",
      what,
      agreement.correlation,
      LuminanceAgreement::kMinCorrelation);
}

void ExpectColor(const Image& lab, const char* what) {
  const ChromaLevel chroma = MeasureChroma(lab);
  if (chroma.IsGray()) {
    throw InvalidArgument(
        "{} has no colour (mean chroma {:.3g} Lab units); colour it first", what, chroma.mean);
  }
}

}  // namespace color3d
