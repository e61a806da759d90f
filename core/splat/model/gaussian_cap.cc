#include "core/splat/model/gaussian_cap.h"

#include <algorithm>
#include <cstdint>

namespace color3d {
namespace {

constexpr double kMaxGaussiansPerPixel = 0.02;
// Sharper pictures of the same few places do not tell where more surfaces lie.
constexpr int kCountedSidePx = 500;
constexpr int kMinCap = 5000;
constexpr int64_t kIterationsPerView = 150;
constexpr int64_t kMinIterationCap = 1500;

}  // namespace

int GaussianCap(int wanted, const std::vector<Camera>& cameras, int max_side_px) {
  const int side_px = max_side_px > 0 ? std::min(max_side_px, kCountedSidePx) : kCountedSidePx;
  double pixels = 0.0;
  for (const Camera& full : cameras) {
    const Camera camera = full.FitWithin(side_px);
    pixels += static_cast<double>(camera.width) * camera.height;
  }
  const double cap = std::max<double>(kMinCap, kMaxGaussiansPerPixel * pixels);
  return static_cast<int>(std::min<double>(wanted, cap));
}

int IterationCap(int wanted, int training_views) {
  const int64_t cap = std::max(kMinIterationCap, kIterationsPerView * training_views);
  return static_cast<int>(std::min<int64_t>(wanted, cap));
}

}  // namespace color3d
