// Adam (Kingma & Ba 2015) over planar parameters, one learning rate per row. Internal to the splat
// module; deterministic for every thread count.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/parallel.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {

inline constexpr float kAdamBeta1 = 0.9f;  // default
inline constexpr float kAdamBeta2 = 0.999f;
inline constexpr float kAdamEpsilon = 1e-15f;

struct AdamMoments {
  ParameterBlock first;
  ParameterBlock second;
};

// One step. `step` counts from 1; `beta1` is the decay of the first moment, 0..1. Rows with
// learning rate 0 and their moments are unchanged. Returns false if a gradient or a new parameter
// is not finite; the parameters must then be restored.
bool AdamStep(const ParameterBlock& gradient,
              const std::vector<float>& learning_rates,
              int64_t step,
              ThreadPool& pool,
              ParameterBlock& parameters,
              AdamMoments& moments,
              float beta1 = kAdamBeta1);

}  // namespace color3d
