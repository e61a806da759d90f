// Tensors by name, in a fixed order, into files and back. Torch in the interface.
#pragma once

#include <torch/types.h>

#include <string>
#include <utility>
#include <vector>

#include "core/colorizer/tensor_file.h"

namespace color3d {

using NamedTensors = std::vector<std::pair<std::string, torch::Tensor>>;

enum class StoredType { kFloat32, kFloat16 };
void PutTensors(const NamedTensors& tensors,
                const std::string& prefix,
                StoredType type,
                TensorFile* file);
// Copies the arrays into the tensors, and takes them out of the file. Throws
// Error{kInvalidArgument} naming `what` and the array that is missing, of another shape or not
// finite.
void TakeTensors(const NamedTensors& tensors,
                 const std::string& prefix,
                 const std::string& what,
                 TensorFile* file);

}  // namespace color3d
