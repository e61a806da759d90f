// Pictures as torch's tensors and back, float32. Pure functions.
#pragma once

#include <torch/types.h>

#include "core/base/image.h"

namespace color3d {

// [1,C,H,W], a copy.
torch::Tensor TensorFromImage(const Image& image);
// Of [1,C,H,W] or [C,H,W], in any memory format.
Image ImageFromTensor(const torch::Tensor& tensor);

}  // namespace color3d
