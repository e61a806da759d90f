#include "core/splat/model/gaussian_cap.h"

#include <algorithm>

namespace color3d {
namespace {

constexpr double kMaxGaussiansPerPixel = 0.02;
// With few views, a higher resolution shows no more surfaces: for at most kSparseViews views pixels
// are counted at this size, for more views gradually at their own.
constexpr int kSparseSidePx = 500;
constexpr double kSparseViews = 12.0;
constexpr int kMinCap = 5000;

double Pixels(const std::vector<Camera>& cameras, int max_side_px) {
  double pixels = 0.0;
  for (const Camera& full : cameras) {
    const Camera camera = full.FitWithin(max_side_px);
    pixels += static_cast<double>(camera.width) * camera.height;
  }
  return pixels;
}

}  // namespace

double Sparsity(double sparse_views, int views) {
  const double ratio = std::min(1.0, sparse_views / std::max(1.0, static_cast<double>(views)));
  return ratio * ratio;
}

int GaussianCap(int wanted, const std::vector<Camera>& cameras, int max_side_px) {
  const int sparse_side_px = max_side_px > 0 ? std::min(max_side_px, kSparseSidePx) : kSparseSidePx;
  const double sparsity = Sparsity(kSparseViews, static_cast<int>(cameras.size()));
  const double pixels =
      sparsity * Pixels(cameras, sparse_side_px) + (1.0 - sparsity) * Pixels(cameras, max_side_px);
  const double cap = std::max<double>(kMinCap, kMaxGaussiansPerPixel * pixels);
  return static_cast<int>(std::min<double>(wanted, cap));
}

}  // namespace color3d
