// Colour rows of a ParameterBlock: channel after channel, from kColorRow on. Internal to the splat
// module. A plain value.
#pragma once

#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {

struct ColorLayout {
  ColorSpace space = ColorSpace::kLab;
  int channels = 1;          // 1: L' alone; 3
  int sh_degree = 0;         // of the first channel
  int chroma_sh_degree = 0;  // of the others

  int Coefficients(int channel) const;
  int Row(int channel) const;  // the first row of a channel
  int rows() const;            // of a whole block, geometry included

  // Value of a channel whose harmonics are zero.
  float Base(int channel) const;
  // How a block is drawn; harmonics above `active_degree` are left out. R, G, B and L' are not
  // below zero; a' and b' are not limited.
  ColorSpec Spec(int active_degree = 3) const;

  bool operator==(const ColorLayout&) const = default;
};

ColorLayout LayoutOf(const GaussianModel& model);

}  // namespace color3d
