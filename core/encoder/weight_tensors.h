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

// Returns the stored size of an array along one dimension, or 0 if it has no such dimension.
inline int64_t StoredSize(const WeightReader& reader, const std::string& name, size_t dimension) {
  const std::vector<int64_t> shape = reader.ShapeOf(name);
  return dimension < shape.size() ? shape[dimension] : 0;
}

// Weight and bias of a linear layer, a convolution or a norm.
struct Layer {
  torch::Tensor weight, bias;

  torch::Tensor Linear(const torch::Tensor& x) const { return torch::linear(x, weight, bias); }
  // Norm over the last dimension.
  torch::Tensor Norm(const torch::Tensor& x) const {
    constexpr double kEpsilon = 1e-5;
    return torch::layer_norm(x, {x.size(-1)}, weight, bias, kEpsilon);
  }
};

// Takes `name`weight of this shape and `name`bias of its first size.
inline Layer TakeLayer(WeightReader& reader,
                       const std::string& name,
                       const std::vector<int64_t>& shape) {
  return {TakeTensor(reader, name + "weight", shape),
          TakeTensor(reader, name + "bias", {shape[0]})};
}

}  // namespace color3d
