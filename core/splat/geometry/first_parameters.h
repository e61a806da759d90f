// Initial parameters of training, in the kernels' form. Internal to the splat module. Pure.
#pragma once

#include <cstdint>

#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {

// Returns `from` with `channels` channels of `coefficients` spherical harmonics each: existing ones
// are cut or extended, a single channel is copied to all. Takes an evenly spaced subset if there
// are more than `most` Gaussians.
ParameterBlock FirstParameters(const GaussianModel& from,
                               int channels,
                               int coefficients,
                               int64_t most);

}  // namespace color3d
