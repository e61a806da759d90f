// What training begins with, in the kernels' form. Internal to the splat module. Pure.
#pragma once

#include <cstdint>

#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {

// `from` with `channels` channels of `coefficients` spherical harmonics each: its own are cut or
// extended, a single channel serves for all. An evenly spaced part where it has more than `most`
// Gaussians.
ParameterBlock FirstParameters(const GaussianModel& from,
                               int channels,
                               int coefficients,
                               int64_t most);

}  // namespace color3d
