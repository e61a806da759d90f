// Named tensors in a fixed order, stored in and restored from files. Torch in the interface.
#pragma once

#include <torch/types.h>

#include <string>
#include <utility>
#include <vector>

#include "core/colorizer/model/tensor_file.h"

namespace color3d {

using NamedTensors = std::vector<std::pair<std::string, torch::Tensor>>;

enum class StoredType { kFloat32, kFloat16 };
void PutTensors(const NamedTensors& tensors,
                const std::string& prefix,
                StoredType type,
                TensorFile* file);
// Moves the arrays out of the file into the tensors. Throws Error{kInvalidArgument} naming `what`
// and an array that is missing, misshapen or not finite.
void TakeTensors(const NamedTensors& tensors,
                 const std::string& prefix,
                 const std::string& what,
                 TensorFile* file);

}  // namespace color3d
