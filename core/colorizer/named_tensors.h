// Tensors by name, in a fixed order. Plain value, with torch in the interface.
#pragma once

#include <torch/types.h>

#include <string>
#include <utility>
#include <vector>

namespace color3d {

using NamedTensors = std::vector<std::pair<std::string, torch::Tensor>>;

}  // namespace color3d
