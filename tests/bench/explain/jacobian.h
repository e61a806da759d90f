// Norms of Jacobians. Torch in the interface. Pure functions.
#pragma once

#include <torch/types.h>

#include <cstdint>
#include <functional>

namespace color3d {

// Returns the spectral norm of the Jacobian of `f` at `x`, after `iterations` steps of power
// iteration on J^T J from a random start: a lower bound that grows with the steps. `f` must be
// differentiable twice by torch.
double JacobianNorm(const std::function<torch::Tensor(const torch::Tensor&)>& f,
                    const torch::Tensor& x,
                    int iterations,
                    uint64_t seed);

}  // namespace color3d
