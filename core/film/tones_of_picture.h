// Mean and standard deviation of a picture's tones, to normalise exposure and contrast. Internal to
// the film module.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/base/image.h"

namespace color3d {

struct TonesOfPicture {
  double mean = 0.0, deviation = 0.0;

  explicit TonesOfPicture(const Image& image) {
    double sum = 0.0, squares = 0.0;
    for (const float v : image.data) {
      sum += v;
      squares += static_cast<double>(v) * v;
    }
    const double n = static_cast<double>(image.data.size());
    mean = sum / n;
    deviation = std::sqrt(std::max(0.0, squares / n - mean * mean));
  }
};

}  // namespace color3d
