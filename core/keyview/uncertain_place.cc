#include "core/keyview/uncertain_place.h"

#include <algorithm>

#include "core/image/codec.h"

namespace color3d {
namespace {

constexpr int kSidePx = 100;      // at which places are compared
constexpr int kReachPx = 10;      // around a place, there
constexpr double kWorthy = 0.02;  // less is not worth anybody's time

// Sums over all rectangles that begin in the corner: (width + 1) x (height + 1).
std::vector<double> SummedArea(const Image& picture) {
  const size_t stride = picture.width + 1;
  std::vector<double> sums(stride * (picture.height + 1), 0.0);
  for (int y = 0; y < picture.height; ++y) {
    double row = 0.0;
    for (int x = 0; x < picture.width; ++x) {
      row += 1.0 - picture.At(0, y, x);
      sums[(y + 1) * stride + x + 1] = sums[y * stride + x + 1] + row;
    }
  }
  return sums;
}

}  // namespace

UncertainPlace LeastCertainPlace(const std::vector<Image>& confidence) {
  UncertainPlace best;
  best.uncertainty = kWorthy;
  for (size_t view = 0; view < confidence.size(); ++view) {
    const Image& full = confidence[view];
    if (full.Empty()) continue;
    const Image small = FitWithin(full, kSidePx);
    const std::vector<double> sums = SummedArea(small);
    const size_t stride = small.width + 1;
    // Surroundings that the picture cuts off count as sure: what lies amid the picture is better
    // seen.
    constexpr double kArea = (2 * kReachPx + 1) * (2 * kReachPx + 1);
    for (int y = 0; y < small.height; ++y) {
      const int top = std::max(0, y - kReachPx), bottom = std::min(small.height, y + kReachPx + 1);
      for (int x = 0; x < small.width; ++x) {
        const int left = std::max(0, x - kReachPx), right = std::min(small.width, x + kReachPx + 1);
        const double mean = (sums[bottom * stride + right] - sums[top * stride + right] -
                             sums[bottom * stride + left] + sums[top * stride + left]) /
                            kArea;
        if (mean <= best.uncertainty) continue;
        best.view = static_cast<int>(view);
        best.x = std::min(full.width - 1, (2 * x + 1) * full.width / (2 * small.width));
        best.y = std::min(full.height - 1, (2 * y + 1) * full.height / (2 * small.height));
        best.uncertainty = mean;
      }
    }
  }
  if (best.view < 0) best.uncertainty = 0.0;
  return best;
}

}  // namespace color3d
