#include "core/splat/geometry/held_out.h"

#include <algorithm>
#include <cmath>

namespace color3d {

PictureQuality CompareClamped(const PlaneBuffer& truth,
                              ImageLoss& loss,
                              ThreadPool& pool,
                              PlaneBuffer& drawn) {
  double squares = 0.0;
  for (int c = 0; c < drawn.channels; ++c) {
    for (int y = 0; y < drawn.height; ++y) {
      float* a = drawn.Row(c, y);
      const float* b = truth.Row(c, y);
      for (int x = 0; x < drawn.width; ++x) {
        a[x] = std::clamp(a[x], 0.0f, 1.0f);
        squares += static_cast<double>(a[x] - b[x]) * (a[x] - b[x]);
      }
    }
  }
  const double samples = static_cast<double>(drawn.width) * drawn.height * drawn.channels;
  PlaneBuffer unused;
  const LossValue value = loss.Evaluate(drawn, truth, nullptr, {}, pool, unused);
  PictureQuality quality;
  quality.psnr_db = std::min(99.0, -10.0 * std::log10(std::max(squares / samples, 1e-12)));
  quality.ssim = 1.0 - value.ssim;
  quality.l1 = value.l1;
  return quality;
}

Image ImageFromPlanes(const PlaneBuffer& planes) {
  Image image(planes.width, planes.height, planes.channels);
  for (int c = 0; c < planes.channels; ++c) {
    for (int y = 0; y < planes.height; ++y) {
      std::copy_n(
          planes.Row(c, y), planes.width, image.Plane(c) + static_cast<size_t>(y) * planes.width);
    }
  }
  return image;
}

}  // namespace color3d
