// Tensors into archive arrays and back.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "core/colorizer/adam.h"
#include "core/colorizer/archive.h"

namespace color3d {

ArchiveArray ArrayFromTensor(const torch::Tensor& tensor, ArchiveArray::Type type);
// float32, channels-last when it has four dimensions.
torch::Tensor TensorFromArray(const ArchiveArray& array);

void PutTensors(const NamedTensors& tensors,
                const std::string& prefix,
                ArchiveArray::Type type,
                Archive& archive);
// Copies the arrays into the tensors, and takes them out of the archive. Throws
// Error{kInvalidArgument} naming `what` and the array that is missing, of another shape or not
// finite.
void TakeTensors(const NamedTensors& tensors,
                 const std::string& prefix,
                 const std::string& what,
                 Archive& archive);

}  // namespace color3d
