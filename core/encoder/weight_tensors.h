// Tensors from arrays of a weight file, without a copy.
#pragma once

#include <torch/types.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/weights/weight_reader.h"

namespace color3d {

// Returns a float32 tensor that takes over the memory of the array.
inline torch::Tensor TensorFromWeights(WeightArray array) {
  auto values = std::make_shared<std::vector<float>>(std::move(array.values));
  float* data = values->data();
  return torch::from_blob(
      data,
      array.shape,
      [values = std::move(values)](void*) mutable { values.reset(); },
      torch::kFloat32);
}

// WeightReader::Take as a tensor, channels-last if it has four dimensions.
inline torch::Tensor TakeTensor(WeightReader& reader,
                                const std::string& name,
                                const std::vector<int64_t>& shape) {
  const torch::Tensor tensor = TensorFromWeights(reader.Take(name, shape));
  return shape.size() == 4 ? tensor.contiguous(at::MemoryFormat::ChannelsLast) : tensor;
}

}  // namespace color3d
