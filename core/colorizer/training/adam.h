// Adam (Kingma & Ba 2015) over named tensors, whose state can be checkpointed. Torch in the
// interface; used inside core/colorizer only. Not thread-safe.
#pragma once

#include <torch/types.h>

#include <cstdint>
#include <vector>

#include "core/colorizer/model/named_tensors.h"

namespace color3d {

class Adam {
 public:
  // Updates the given tensors in place. Requires: they have gradients enabled.
  explicit Adam(const NamedTensors& parameters);

  // Takes one step and clears the gradients. A gradient with a norm above `max_norm` is scaled down
  // to it. Returns the norm before scaling; if it is not finite, nothing changes.
  double Step(double learning_rate, double max_norm);

  // First and second moments, named "m." and "v." plus the parameter's name. Shares storage.
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
