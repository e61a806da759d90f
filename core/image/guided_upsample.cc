#include "core/image/guided_upsample.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/image/box_mean.h"
#include "core/image/codec.h"

namespace color3d {
namespace {

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
  // Keeps the coarse prediction; the fit adds only the variation of L within a cell.
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
