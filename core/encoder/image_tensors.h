// Conversion between images and torch tensors, float32. Pure functions.
#pragma once

#include <torch/types.h>

#include <vector>

#include "core/base/image.h"

namespace color3d {

// Returns a copy as [1,C,H,W].
torch::Tensor TensorFromImage(const Image& image);
// Requires: [1,C,H,W] or [C,H,W], in any memory format.
Image ImageFromTensor(const torch::Tensor& tensor);

// Returns the values of a float32 tensor in row-major order.
std::vector<float> TensorValues(const torch::Tensor& tensor);

// Extends [1,C,H,W] at its right and bottom to multiples of `multiple`, by repeating the border.
torch::Tensor PadByReplication(const torch::Tensor& x, int multiple);

}  // namespace color3d
