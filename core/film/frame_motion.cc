#include "core/film/frame_motion.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace color3d {

double MotionOf(const Image& flow) {
  constexpr double kFastShare = 0.03;
  std::vector<float> lengths(flow.PlaneSize());
  for (size_t i = 0; i < lengths.size(); ++i) {
    const float x = flow.Plane(0)[i], y = flow.Plane(1)[i];
    lengths[i] = std::sqrt(x * x + y * y);
  }
  const auto fast = lengths.begin() + static_cast<std::ptrdiff_t>(
                                          (1.0 - kFastShare) * static_cast<double>(lengths.size()));
  std::nth_element(lengths.begin(), fast, lengths.end());
  return *fast / std::max(flow.width, flow.height);
}

Image MovedPositions(Image flow) {
  for (int y = 0; y < flow.height; ++y) {
    for (int x = 0; x < flow.width; ++x) {
      flow.At(0, y, x) += static_cast<float>(x);
      flow.At(1, y, x) += static_cast<float>(y);
    }
  }
  return flow;
}

}  // namespace color3d
