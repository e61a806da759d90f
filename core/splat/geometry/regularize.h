// Regularization of Gaussian shapes: the penalties on opacity and scale of 3DGS-MCMC (Kheradmand et
// al. 2024), and a limit on needles. Internal to the splat module; deterministic for every thread
// count.
#pragma once

#include "core/base/parallel.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {

// Adds the gradients of opacity_penalty * mean(opacity) + scale_penalty * mean(scale).
void AddPenaltyGradients(const ParameterBlock& parameters,
                         float opacity_penalty,
                         float scale_penalty,
                         ThreadPool& pool,
                         ParameterBlock& gradient);

// Shortens the longest axis to exp(max_log_ratio) times the middle one. Needles fit the pixels of
// one view and are streaks in all others; flat Gaussians are surfaces and stay as they are.
void LimitNeedles(float max_log_ratio, ThreadPool& pool, ParameterBlock& parameters);

}  // namespace color3d
