// Conversion between images and torch tensors, float32. Pure functions.
#pragma once

#include <torch/types.h>

#include "core/base/image.h"

namespace color3d {

// Returns a copy as [1,C,H,W].
torch::Tensor TensorFromImage(const Image& image);
// Requires: [1,C,H,W] or [C,H,W], in any memory format.
Image ImageFromTensor(const torch::Tensor& tensor);

}  // namespace color3d
