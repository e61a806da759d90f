// Padding of pictures to multiples of the network's stride.
#pragma once

#include <torch/types.h>

namespace color3d {

// STILL.md "Stage 1d": every picture is padded to multiples of 32.
inline constexpr int kPadMultiple = 32;

// Extends [1,C,H,W] at its right and bottom to multiples of `multiple` by reflection, or by
// replication if the picture is too small to reflect.
torch::Tensor PadToMultiple(const torch::Tensor& x, int multiple);

}  // namespace color3d
