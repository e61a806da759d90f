#include "core/keycolor/edge_weights.h"

#include <cmath>
#include <cstdint>

namespace color3d {

GridSystem SystemOfLuminance(const Image& luminance, double sigma, ThreadPool& pool) {
  GridSystem system(luminance.width, luminance.height);
  const auto per_sigma = static_cast<float>(1.0 / sigma);
  const auto weight = [per_sigma](float x, float y) {
    const float ratio = std::abs(x - y) * per_sigma;
    return 1.0f / (1.0f + ratio * ratio * ratio);
  };
  constexpr float kDiagonal = 0.70710678f;
  const int64_t w = luminance.width;
  pool.ForEach(luminance.height, [&](int64_t y, int) {
    const float* here = luminance.data.data() + y * w;
    for (int64_t x = 0; x + 1 < w; ++x) system.right[y * w + x] = weight(here[x], here[x + 1]);
    if (y + 1 == luminance.height) return;
    const float* below = here + w;
    for (int64_t x = 0; x < w; ++x) system.down[y * w + x] = weight(here[x], below[x]);
    for (int64_t x = 0; x + 1 < w; ++x) {
      system.down_right[y * w + x] = kDiagonal * weight(here[x], below[x + 1]);
      system.down_left[y * w + x + 1] = kDiagonal * weight(here[x + 1], below[x]);
    }
  });
  return system;
}

}  // namespace color3d
