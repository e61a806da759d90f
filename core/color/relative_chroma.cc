#include "core/color/relative_chroma.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace color3d {
namespace {

constexpr double kOffset = 16.0;  // of L*, = 116 Y^(1/3) - 16
constexpr double kMiddle = 50.0;
constexpr int kWindowPx = 8;
constexpr double kLeastChroma = 4.0;  // Lab units: below, noise decides the ratio of two chromas
constexpr double kPriorPower = 0.5;
constexpr double kPriorSquares = 20.0;  // sum of squares of log (L + 16) that counts as much

template <class Operation>
Image ByScale(const RelativeChroma& relative,
              const Image& luminance,
              Image ab,
              const Operation& operation) {
  if (relative.power == 0.0) return ab;
  for (size_t i = 0; i < luminance.data.size(); ++i) {
    const float scale = relative.Scale(luminance.data[i]);
    for (int c = 0; c < ab.channels; ++c) operation(ab.Plane(c)[i], scale);
  }
  return ab;
}

}  // namespace

float RelativeChroma::Scale(float luminance) const {
  if (power == 0.0) return 1.0f;
  const double l = std::clamp<double>(luminance, 0.0, 100.0);
  return static_cast<float>(std::pow((l + kOffset) / (kMiddle + kOffset), power));
}

Image ToRelative(const RelativeChroma& relative, const Image& luminance, Image ab) {
  return ByScale(relative, luminance, std::move(ab), [](float& v, float scale) { v /= scale; });
}

Image FromRelative(const RelativeChroma& relative, const Image& luminance, Image ab) {
  return ByScale(relative, luminance, std::move(ab), [](float& v, float scale) { v *= scale; });
}

RelativeChroma FitRelativeChroma(const Image& luminance, const Image& ab) {
  double squares = kPriorSquares, products = kPriorSquares * kPriorPower;
  for (int y0 = 0; y0 < luminance.height; y0 += kWindowPx) {
    for (int x0 = 0; x0 < luminance.width; x0 += kWindowPx) {
      double n = 0.0, x_sum = 0.0, y_sum = 0.0, xx = 0.0, xy = 0.0;
      for (int y = y0; y < std::min(y0 + kWindowPx, luminance.height); ++y) {
        for (int x = x0; x < std::min(x0 + kWindowPx, luminance.width); ++x) {
          const double chroma = std::hypot(ab.At(0, y, x), ab.At(1, y, x));
          if (chroma < kLeastChroma) continue;
          const double u = std::log(std::max(0.0f, luminance.At(0, y, x)) + kOffset);
          const double v = std::log(chroma);
          n += 1.0, x_sum += u, y_sum += v, xx += u * u, xy += u * v;
        }
      }
      if (n < 2.0) continue;
      squares += xx - x_sum * x_sum / n;
      products += xy - x_sum * y_sum / n;
    }
  }
  return {std::clamp(products / squares, 0.0, 1.0)};
}

}  // namespace color3d
