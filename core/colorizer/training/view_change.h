// A second augmentation of a training sample, for the consistency term (STILL.md "Training"): a
// random affine map, which may mirror, and a change of light. Torch in the interface; used by
// core/colorizer and benchmarks only. Pure functions, thread-safe.
#pragma once

#include <torch/types.h>

#include <array>
#include <cstdint>

#include "core/base/random.h"

namespace color3d {

// Affine map of positions in a picture, which span -1..1 over its width and its height: rows of
// [x y 1].
using AffineMap = std::array<double, 6>;

// Requires: the map is invertible.
AffineMap Inverse(const AffineMap& map);

// The identity by default.
struct ViewChange {
  double angle = 0.0;    // radians
  double scale = 1.0;    // pixels of the picture per pixel of the changed one, > 0
  double stretch = 1.0;  // of x relative to y, > 0: foreshortening
  bool mirrored = false;
  double shift_x = 0.0;  // of the centre, in halves of the width
  double shift_y = 0.0;  // in halves of the height
  double light = 0.0;    // offset of L
  double contrast = 1.0;

  // Rotation up to 15 degrees, scale 1/1.25 to 1.25, stretch 1/1.15 to 1.15, shift up to a tenth,
  // mirror image with 0.5, light up to 5 units of L, contrast 0.9 to 1.1.
  static ViewChange Draw(Random& random);

  // Position in the picture of each position in the changed picture, both of this size.
  AffineMap Positions(int64_t height, int64_t width) const;
  // Returns L in this light, within 0..100.
  torch::Tensor InLight(const torch::Tensor& luminance) const;
};

// Positions of the pixel centres under `map`, [1,height,width,2], for Warp. Pictures of another
// resolution have the same map.
torch::Tensor SamplingGrid(const AffineMap& map, int64_t height, int64_t width);

enum class Border { kZero, kRepeat, kReflect };  // values outside of the picture

// Samples a picture [1,C,H,W] bilinearly. Gradients flow to the picture.
torch::Tensor Warp(const torch::Tensor& picture, const torch::Tensor& grid, Border border);

}  // namespace color3d
