#include "core/splat/geometry/held_out.h"

#include <algorithm>
#include <cmath>

namespace color3d {

namespace {

// Calls change(channel, y, x) for each sample that is masked out.
template <typename Change>
void ForMasked(const PlaneBuffer& mask, int channels, Change change) {
  for (int c = 0; c < channels; ++c) {
    for (int y = 0; y < mask.height; ++y) {
      const float* counts = mask.Row(0, y);
      for (int x = 0; x < mask.width; ++x) {
        if (counts[x] == 0.0f) change(c, y, x);
      }
    }
  }
}

double CountingShare(const PlaneBuffer* mask) {
  if (mask == nullptr) return 1.0;
  double masked = 0.0;
  ForMasked(*mask, 1, [&](int, int, int) { masked += 1.0; });
  const double pixels = static_cast<double>(mask->width) * mask->height;
  return std::max(pixels - masked, 1.0) / pixels;
}

}  // namespace

void CopyMasked(const PlaneBuffer& mask, const PlaneBuffer& other, PlaneBuffer& planes) {
  ForMasked(mask, planes.channels, [&](int c, int y, int x) {
    planes.Row(c, y)[x] = other.Row(c, y)[x];
  });
}

void ZeroMasked(const PlaneBuffer& mask, PlaneBuffer& planes) {
  ForMasked(mask, planes.channels, [&](int c, int y, int x) { planes.Row(c, y)[x] = 0.0f; });
}

PictureQuality CompareClamped(const PlaneBuffer& truth,
                              const PlaneBuffer* mask,
                              ImageLoss& loss,
                              ThreadPool& pool,
                              PlaneBuffer& drawn) {
  if (mask != nullptr) CopyMasked(*mask, truth, drawn);
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
  const double share = CountingShare(mask);
  const double samples = share * drawn.width * drawn.height * drawn.channels;
  PlaneBuffer unused;
  const LossValue value = loss.Evaluate(drawn, truth, nullptr, {}, pool, unused);
  PictureQuality quality;
  quality.psnr_db = std::min(99.0, -10.0 * std::log10(std::max(squares / samples, 1e-12)));
  quality.ssim = 1.0 - value.ssim / share;
  quality.l1 = value.l1 / share;
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
