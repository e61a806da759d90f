#include "core/image/fill_holes.h"

#include <algorithm>
#include <cmath>

#include "core/image/plane_sampling.h"

namespace color3d {
namespace {

// Halves the size: means of the known pixels, and the share of them that is known (at most 1).
void Pull(const Image& known, const Image& image, Image* small_known, Image* small) {
  const int width = (image.width + 1) / 2, height = (image.height + 1) / 2;
  *small_known = Image(width, height, 1);
  *small = Image(width, height, image.channels);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const float w = known.At(0, y, x);
      small_known->At(0, y / 2, x / 2) += w;
      for (int c = 0; c < image.channels; ++c) {
        small->At(c, y / 2, x / 2) += w * image.At(c, y, x);
      }
    }
  }
  for (size_t i = 0; i < small->PlaneSize(); ++i) {
    float& w = small_known->Plane(0)[i];
    if (w == 0.0f) continue;
    for (int c = 0; c < image.channels; ++c) small->Plane(c)[i] /= w;
    w = std::min(w, 1.0f);
  }
}

void FillLevel(const Image& known, Image* image) {
  if (image->width == 1 && image->height == 1) return;
  const float least = *std::min_element(known.data.begin(), known.data.end());
  if (least >= 1.0f) return;
  Image small_known, small;
  Pull(known, *image, &small_known, &small);
  FillLevel(small_known, &small);
  for (int y = 0; y < image->height; ++y) {
    for (int x = 0; x < image->width; ++x) {
      const float w = known.At(0, y, x);
      if (w >= 1.0f) continue;
      for (int c = 0; c < image->channels; ++c) {
        const float coarse = SampleBilinear(small, c, 0.5 * x - 0.25, 0.5 * y - 0.25);
        image->At(c, y, x) = std::lerp(coarse, image->At(c, y, x), w);
      }
    }
  }
}

}  // namespace

void FillHoles(const Image& known, Image* image) {
  Image certain = known;
  for (float& w : certain.data) w = w > 0.0f ? 1.0f : 0.0f;
  if (std::find(certain.data.begin(), certain.data.end(), 1.0f) == certain.data.end()) return;
  FillLevel(certain, image);
}

}  // namespace color3d
