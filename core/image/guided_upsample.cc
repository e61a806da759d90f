#include "core/image/guided_upsample.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/image/codec.h"

namespace color3d {
namespace {

// Mean over a (2 radius + 1)^2 window, clipped at the borders; running sums in float64.
void BoxMean(const float* in, float* out, int width, int height, int radius) {
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

Image BoxMean(const Image& image, int radius) {
  Image out(image.width, image.height, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    BoxMean(image.Plane(c), out.Plane(c), image.width, image.height, radius);
  }
  return out;
}

Image Product(const Image& one_channel, const Image& image) {
  Image out(image.width, image.height, image.channels);
  for (int c = 0; c < image.channels; ++c) {
    for (size_t i = 0; i < image.PlaneSize(); ++i) {
      out.Plane(c)[i] = one_channel.data[i] * image.Plane(c)[i];
    }
  }
  return out;
}

}  // namespace

Image UpsampleGuided(const Image& ab, const Image& luminance, int radius, float variance_floor) {
  Image guide = Resize(luminance, ab.width, ab.height);
  // Centred on mid-grey: the products below stay small, so float32 suffices.
  for (float& value : guide.data) value -= 50.0f;
  const Image mean_l = BoxMean(guide, radius);
  const Image mean_ll = BoxMean(Product(guide, guide), radius);
  const Image mean_ab = BoxMean(ab, radius);
  const Image mean_lab = BoxMean(Product(guide, ab), radius);
  Image slope(ab.width, ab.height, ab.channels);
  Image offset(ab.width, ab.height, ab.channels);
  for (int c = 0; c < ab.channels; ++c) {
    for (size_t i = 0; i < ab.PlaneSize(); ++i) {
      const float variance = std::max(0.0f, mean_ll.data[i] - mean_l.data[i] * mean_l.data[i]);
      const float covariance = mean_lab.Plane(c)[i] - mean_l.data[i] * mean_ab.Plane(c)[i];
      slope.Plane(c)[i] = covariance / (variance + variance_floor);
    }
  }
  slope = BoxMean(slope, radius);
  // Keeps the coarse prediction: only what L adds within a cell comes from the fit.
  for (int c = 0; c < ab.channels; ++c) {
    for (size_t i = 0; i < ab.PlaneSize(); ++i) {
      offset.Plane(c)[i] = ab.Plane(c)[i] - slope.Plane(c)[i] * guide.data[i];
    }
  }
  const Image full_slope = Resize(slope, luminance.width, luminance.height);
  Image out = Resize(offset, luminance.width, luminance.height);
  for (int c = 0; c < out.channels; ++c) {
    for (size_t i = 0; i < out.PlaneSize(); ++i) {
      out.Plane(c)[i] += full_slope.Plane(c)[i] * (luminance.data[i] - 50.0f);
    }
  }
  return out;
}

}  // namespace color3d
