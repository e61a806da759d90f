#include "core/film/local_contrast.h"

#include <algorithm>
#include <cmath>

#include "core/image/box_mean.h"

namespace color3d {

Image LocalContrast(const Image& luminance) {
  constexpr int kRadius = 7;
  constexpr float kGrain = 4.0f;  // variance of grain, L^2
  const Image mean = BoxMean(luminance, kRadius);
  Image out(luminance.width, luminance.height, 1), square = out;
  for (size_t i = 0; i < out.data.size(); ++i) {
    out.data[i] = luminance.data[i] - mean.data[i];
    square.data[i] = out.data[i] * out.data[i];
  }
  const Image variance = BoxMean(square, kRadius);
  for (size_t i = 0; i < out.data.size(); ++i) {
    out.data[i] /= std::sqrt(std::max(0.0f, variance.data[i]) + kGrain);
  }
  return out;
}

}  // namespace color3d
