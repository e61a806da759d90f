// Borders that bring a picture to a multiple of the network's stride.
#pragma once

#include <torch/types.h>

#include "core/base/image.h"

namespace color3d {

// STILL.md "Stage 1d": every picture is padded to multiples of 32.
inline constexpr int kPadMultiple = 32;

// [1,C,H,W] extended to the right and downwards to multiples of `multiple` by reflection
// (replication where the picture is too small to reflect).
torch::Tensor PadToMultiple(const torch::Tensor& x, int multiple);

// The upper left part of a picture, without what padding added.
Image CropTo(const Image& image, int width, int height);

}  // namespace color3d
