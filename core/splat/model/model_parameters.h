// Conversion between GaussianModel (files, interfaces) and the kernels' planar form. Internal to
// the splat module. Stateless.
#pragma once

#include <vector>

#include "core/splat/model/color_layout.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {

// Throws Error{kInvalidArgument} unless channels, degrees and buffer sizes fit together.
void CheckModel(const GaussianModel& model);

// Rows: position, log scale, rotation, opacity, then sh_l, sh_a, sh_b.
ParameterBlock ParametersFromModel(const GaussianModel& model);

// The inverse.
GaussianModel ModelFromParameters(const ParameterBlock& parameters, const ColorLayout& layout);

// Copies a buffer of `width` numbers per Gaussian to or from the rows that begin at `row`.
void ToPlanar(const std::vector<float>& from, int width, int row, ParameterBlock& to);
std::vector<float> FromPlanar(const ParameterBlock& from, int row, int width);

}  // namespace color3d
