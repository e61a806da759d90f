// Smooth random displacement of the image plane. Immutable, thread-safe.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/base/random.h"

namespace color3d {

struct PlanePoint {
  double x = 0.0;
  double y = 0.0;
};
inline PlanePoint operator+(const PlanePoint& a, const PlanePoint& b) {
  return {a.x + b.x, a.y + b.y};
}

// Reflects a coordinate at 0 and `side` as often as needed to lie between them.
inline double Reflected(double value, double side) {
  const double period = 2.0 * side;
  value = std::fmod(value, period);
  if (value < 0.0) value += period;
  return std::min(value, period - value);
}

// Cubic B-spline over nodes that are uniform in -alpha..alpha px and sigma px apart, so that the
// displacement never exceeds alpha.
class ElasticField {
 public:
  // Requires: positions in 0..size_px. `alpha_px`: bound of each component.
  ElasticField(int size_px, double alpha_px, double sigma_px, Random& random)
      : spacing_(sigma_px), nodes_(static_cast<int>(size_px / sigma_px) + 5) {
    offsets_.resize(static_cast<size_t>(nodes_) * nodes_);
    for (PlanePoint& offset : offsets_) {
      offset.x = random.NextUniform(-alpha_px, alpha_px);
      offset.y = random.NextUniform(-alpha_px, alpha_px);
    }
  }

  PlanePoint At(double x, double y) const {
    const Weights wx = At(x);
    const Weights wy = At(y);
    PlanePoint sum;
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < 4; ++i) {
        const PlanePoint& node =
            offsets_[static_cast<size_t>(wy.first + j) * nodes_ + wx.first + i];
        sum.x += wy.value[j] * wx.value[i] * node.x;
        sum.y += wy.value[j] * wx.value[i] * node.y;
      }
    }
    return sum;
  }

 private:
  struct Weights {
    int first = 0;
    double value[4] = {};
  };
  Weights At(double position) const {
    const double cell = std::clamp(position / spacing_, 0.0, static_cast<double>(nodes_ - 4));
    Weights weights;
    weights.first = std::min(static_cast<int>(cell), nodes_ - 4);
    const double t = cell - weights.first;
    weights.value[0] = (1 - t) * (1 - t) * (1 - t) / 6.0;
    weights.value[1] = (3 * t * t * t - 6 * t * t + 4) / 6.0;
    weights.value[2] = (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6.0;
    weights.value[3] = t * t * t / 6.0;
    return weights;
  }

  double spacing_;
  int nodes_;
  std::vector<PlanePoint> offsets_;
};

}  // namespace color3d
