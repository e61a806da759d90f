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

// `per_sigma(i, j)`: 1 over the sigma of the edge between two pixels.
template <typename PerSigma>
GridSystem SystemWith(const Image& luminance, const PerSigma& per_sigma, ThreadPool& pool) {
  GridSystem system(luminance.width, luminance.height);
  const Image smooth = Smoothed(luminance, pool);
  const float* l = smooth.data.data();
  const auto weight = [&](int64_t i, int64_t j) {
    const float ratio = std::abs(l[i] - l[j]) * per_sigma(i, j);
    return 1.0f / (1.0f + ratio * ratio * ratio);
  };
  constexpr float kDiagonal = 0.70710678f;
  const int64_t w = luminance.width;
  pool.ForEach(luminance.height, [&](int64_t y, int) {
    const int64_t row = y * w;
    for (int64_t i = row; i + 1 < row + w; ++i) system.right[i] = weight(i, i + 1);
    if (y + 1 == luminance.height) return;
    for (int64_t i = row; i < row + w; ++i) system.down[i] = weight(i, i + w);
    for (int64_t i = row; i + 1 < row + w; ++i) {
      system.down_right[i] = kDiagonal * weight(i, i + w + 1);
      system.down_left[i + 1] = kDiagonal * weight(i + 1, i + w);
    }
  });
  return system;
}

}  // namespace

GridSystem SystemOfLuminance(const Image& luminance, double sigma, ThreadPool& pool) {
  const auto per_sigma = static_cast<float>(1.0 / sigma);
  return SystemWith(
      luminance, [&](int64_t, int64_t) { return per_sigma; }, pool);
}

GridSystem SystemOfLuminance(const Image& luminance, const Image& sigma, ThreadPool& pool) {
  const float* each = sigma.data.data();
  return SystemWith(
      luminance, [&](int64_t i, int64_t j) { return 1.0f / std::min(each[i], each[j]); }, pool);
}

}  // namespace color3d
