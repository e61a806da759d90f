#include "core/grid/edge_weights.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace color3d {
namespace {

// Binomial 3x3 filter with repeated borders, so that grain forms no edges.
Image Smoothed(const Image& luminance, ThreadPool& pool) {
  const int w = luminance.width, h = luminance.height;
  Image smooth(w, h, 1);
  pool.ForEach(h, [&](int64_t row, int) {
    const auto y = static_cast<int>(row);
    const float* above = luminance.data.data() + static_cast<int64_t>(std::max(y - 1, 0)) * w;
    const float* here = luminance.data.data() + static_cast<int64_t>(y) * w;
    const float* below = luminance.data.data() + static_cast<int64_t>(std::min(y + 1, h - 1)) * w;
    const auto column = [&](int x) { return above[x] + 2.0f * here[x] + below[x]; };
    float* out = smooth.data.data() + row * w;
    for (int x = 0; x < w; ++x) {
      out[x] = 0.0625f *
               (column(std::max(x - 1, 0)) + 2.0f * column(x) + column(std::min(x + 1, w - 1)));
    }
  });
  return smooth;
}

}  // namespace

GridSystem SystemOfLuminance(const Image& luminance, double sigma, ThreadPool& pool) {
  GridSystem system(luminance.width, luminance.height);
  const Image smooth = Smoothed(luminance, pool);
  const auto per_sigma = static_cast<float>(1.0 / sigma);
  const auto weight = [per_sigma](float x, float y) {
    const float ratio = std::abs(x - y) * per_sigma;
    return 1.0f / (1.0f + ratio * ratio * ratio);
  };
  constexpr float kDiagonal = 0.70710678f;
  const int64_t w = luminance.width;
  pool.ForEach(luminance.height, [&](int64_t y, int) {
    const float* here = smooth.data.data() + y * w;
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
