// Elastic transform of Simard et al. 2003 (PAPER.md "Colour"). Immutable, thread-safe.
#pragma once

#include <algorithm>

#include "core/augment/elastic_field.h"
#include "core/augment/elastic_options.h"
#include "core/base/image.h"
#include "core/base/random.h"

namespace color3d {

// Displacement alpha (G_sigma * u) with u uniform in -1..1 at each pixel, and an affine map A
// without translation that moves three corners of a square by up to affine_px.
class ElasticNoise {
 public:
  // `size_px`: side of the crop; `picture_px`: shorter side of the picture, a third of which is
  // half of the side of the square.
  ElasticNoise(int size_px, int picture_px, const ElasticOptions& options, Random& random);

  // Requires: 0 <= x, y < size_px.
  PlanePoint At(int x, int y) const {
    return {displacement_.At(0, y, x), displacement_.At(1, y, x)};
  }
  // `p`: relative to the centre of the crop.
  PlanePoint Affine(const PlanePoint& p) const {
    return {xx_ * p.x + xy_ * p.y, yx_ * p.x + yy_ * p.y};
  }

 private:
  Image displacement_;  // 2 channels, px
  double xx_ = 1.0, xy_ = 0.0, yx_ = 0.0, yy_ = 1.0;
};

}  // namespace color3d
