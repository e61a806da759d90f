// Adam (Kingma & Ba 2015) over named tensors, with its whole state open to checkpoints. Torch in
// the interface; used inside core/colorizer only. Not thread-safe.
#pragma once

#include <torch/types.h>

#include <cstdint>
#include <vector>

#include "core/colorizer/named_tensors.h"

namespace color3d {

class Adam {
 public:
  // Changes the given tensors in place; they need gradients switched on.
  explicit Adam(const NamedTensors& parameters);

  // One step from the gradients, which are cleared. The gradient is scaled down to `max_norm` when
  // it is longer. Returns its length before; when that is not finite nothing changes.
  double Step(double learning_rate, double max_norm);

  // First and second moments, named "m." and "v." plus the parameter. Storage is shared.
  NamedTensors Moments() const;
  int64_t steps() const { return steps_; }
  void set_steps(int64_t steps) { steps_ = steps; }

 private:
  NamedTensors parameters_;
  std::vector<torch::Tensor> first_;
  std::vector<torch::Tensor> second_;
  int64_t steps_ = 0;
};

}  // namespace color3d
