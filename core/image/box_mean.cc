#include "core/image/box_mean.h"

#include <algorithm>
#include <vector>

namespace color3d {
namespace {

// Running sums in float64.
void MeanOfPlane(const float* in, float* out, int width, int height, int radius) {
  std::vector<double> columns(width, 0.0);
  auto add_row = [&](int y, double sign) {
    for (int x = 0; x < width; ++x) columns[x] += sign * in[static_cast<size_t>(y) * width + x];
  };
  for (int y = 0; y < std::min(radius, height); ++y) add_row(y, 1.0);
  for (int y = 0; y < height; ++y) {
    if (y + radius < height) add_row(y + radius, 1.0);
    if (y - radius - 1 >= 0) add_row(y - radius - 1, -1.0);
    const int rows = std::min(y + radius, height - 1) - std::max(y - radius, 0) + 1;
    double sum = 0.0;
    for (int x = 0; x < std::min(radius, width); ++x) sum += columns[x];
    for (int x = 0; x < width; ++x) {
      if (x + radius < width) sum += columns[x + radius];
      if (x - radius - 1 >= 0) sum -= columns[x - radius - 1];
      const int count = std::min(x + radius, width - 1) - std::max(x - radius, 0) + 1;
      out[static_cast<size_t>(y) * width + x] = static_cast<float>(sum / (rows * count));
    }
  }
}

}  // namespace

Image BoxMean(const Image& image, int radius) {
  Image out(image.width, image.height, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    MeanOfPlane(image.Plane(c), out.Plane(c), image.width, image.height, radius);
  }
  return out;
}

}  // namespace color3d
