// Weight files in the layouts of published networks with seeded random numbers of plausible size,
// as a stand-in for published weights. Pure functions.
#pragma once

#include <cstdint>
#include <vector>

#include "core/weights/weight_map.h"

namespace color3d {

// Sizes of a DDColor; the defaults are those of the published "tiny" (440 arrays, 55 051 016
// values).
struct SyntheticDdcolor {
  std::vector<int> dims{96, 192, 384, 768};
  std::vector<int> depths{3, 3, 9, 3};
  int decoder_channels = 512;  // "nf"
  int query_channels = 256;
  int queries = 100;
  int layers = 9;
  int feed_forward = 2048;

  // Small sizes of the golden files, for unit tests.
  static SyntheticDdcolor Mini();
};

// Norms are as stored: spectral ones unfolded, with u and v of the leading singular vectors. The
// encoder holds structured random features (tests/support/networks/random_features.h).
WeightMap SyntheticDdcolorWeights(const SyntheticDdcolor& sizes, uint64_t seed);

struct SyntheticClip {
  int width = 64;
  int layers = 2;
  int patch_px = 16;
  int grid = 4;
  int embedding = 32;
  int text_width = 32;
  int vocabulary = 518;
  int context = 77;
};

// OpenAI's layout.
WeightMap SyntheticClipWeights(const SyntheticClip& sizes, uint64_t seed);

}  // namespace color3d
