// What 3DGS-MCMC (Kheradmand et al. 2024) adds to the picture's loss: penalties on opacity and
// scale, and noise on positions that lets faint Gaussians explore. Internal to the splat module;
// deterministic whatever the thread count.
#pragma once

#include <cstdint>

#include "core/base/parallel.h"
#include "core/splat/parameter_block.h"

namespace color3d {

// Adds the gradients of opacity_penalty * mean(opacity) + scale_penalty * mean(scale).
void AddPenaltyGradients(const ParameterBlock& parameters,
                         float opacity_penalty,
                         float scale_penalty,
                         ThreadPool& pool,
                         ParameterBlock& gradient);

// position += strength * sigmoid(100 (0.005 - opacity)) * covariance * normal noise. The noise is a
// hash of (seed, Gaussian), so the same seed repeats it.
void AddPositionNoise(float strength, uint32_t seed, ThreadPool& pool, ParameterBlock& parameters);

}  // namespace color3d
