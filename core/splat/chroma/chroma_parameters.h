// Geometry and chroma coefficients in the kernels' form, as both chroma solvers work on them.
// Internal to the splat module. A plain value.
#pragma once

#include <vector>

#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {

struct ChromaParameters {
  // Geometry rows, followed by the coefficients of a' and of b' in place of those of luminance.
  ParameterBlock block;
  ColorSpec color;  // two channels, neutral when all coefficients are zero

  static ChromaParameters From(const GaussianModel& geometry, int chroma_sh_degree);
  // Returns `geometry` with these chroma coefficients.
  GaussianModel ToModel(const GaussianModel& geometry) const;

  int coefficients() const { return color.channel[0].coefficients; }
  float* Row(int channel, int k) { return block.Row(color.channel[channel].row + k); }
  const float* Row(int channel, int k) const { return block.Row(color.channel[channel].row + k); }
};

}  // namespace color3d
