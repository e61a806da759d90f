// Geometric augmentations of the coloured key view (STILL.md "Stage 1c"). Luminance, colour and a
// validity mask share one sampling map. Chroma is never mixed across a hard shuffle edge (nearest
// sampling there). Pure functions of the generator; thread-safe.
#pragma once

#include "core/augment/elastic_options.h"
#include "core/base/image.h"
#include "core/base/random.h"

namespace color3d {

struct AugmentOptions {
  int crop_px = 256;
  // Mild set (default): scale, horizontal flip, elastic, perspective, small L jitter.
  double min_scale = 0.7;
  double max_scale = 1.4;
  double flip_probability = 0.5;
  double elastic_probability = 0.7;
  ElasticOptions elastic;
  double perspective_probability = 0.5;
  double luminance_jitter = 2.0;  // maximum offset of L, and maximum change of contrast in %
  // The paper's additions: rotations by 90 degrees with flips, and an 8x8 grid shuffle.
  double rot90_probability = 0.0;
  double shuffle_probability = 0.0;
  int shuffle_grid = 8;
  static AugmentOptions Paper();
  static AugmentOptions CropsOnly();
};

struct AugmentedSample {
  Image luminance;  // 1 channel, crop_px x crop_px
  Image ab;         // 2 channels
  Image valid;      // 1 channel: 1 where the sample lies inside the source picture
};

// `weight` (1 channel; empty: 1 everywhere) is sampled by the same map and multiplies `valid`.
AugmentedSample Augment(const Image& luminance,
                        const Image& ab,
                        const Image& weight,
                        const AugmentOptions& options,
                        Random& random);
}  // namespace color3d
