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

}  // namespace color3d
