#include "core/augment/depth_filter.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace color3d {
namespace {

constexpr int kRadius = 2;
constexpr int kWindow = (2 * kRadius + 1) * (2 * kRadius + 1);
constexpr int kMedians = 2;
constexpr int kMeans = 3;
constexpr float kSameSurface = 0.06f;  // maximum relative difference of depths

// Collects known depths around a pixel, including its own. Returns their number.
int Neighbors(const Image& depth, int x, int y, std::array<float, kWindow>* values) {
  int count = 0;
  for (int v = std::max(0, y - kRadius); v <= std::min(depth.height - 1, y + kRadius); ++v) {
    for (int u = std::max(0, x - kRadius); u <= std::min(depth.width - 1, x + kRadius); ++u) {
      const float d = depth.At(0, v, u);
      if (d > 0.0f && std::isfinite(d)) (*values)[static_cast<size_t>(count++)] = d;
    }
  }
  return count;
}

template <typename Reduce>
Image Filtered(const Image& depth, Reduce reduce) {
  Image out = depth;
  std::array<float, kWindow> values;
  for (int y = 0; y < depth.height; ++y) {
    for (int x = 0; x < depth.width; ++x) {
      const float center = depth.At(0, y, x);
      if (!(center > 0.0f) || !std::isfinite(center)) {
        out.At(0, y, x) = 0.0f;
        continue;
      }
      const int count = Neighbors(depth, x, y, &values);
      out.At(0, y, x) = reduce(center, values.data(), count);
    }
  }
  return out;
}

float Median(float, float* values, int count) {
  std::nth_element(values, values + count / 2, values + count);
  return values[count / 2];
}

float MeanOfSurface(float center, const float* values, int count) {
  double sum = 0.0;
  int used = 0;
  for (int i = 0; i < count; ++i) {
    if (std::abs(values[i] - center) > kSameSurface * center) continue;
    sum += values[i];
    ++used;
  }
  return static_cast<float>(sum / used);
}

}  // namespace

Image SmoothDepth(const Image& depth) {
  Image out = depth;
  for (int i = 0; i < kMedians; ++i) out = Filtered(out, Median);
  for (int i = 0; i < kMeans; ++i) out = Filtered(out, MeanOfSurface);
  return out;
}

}  // namespace color3d
