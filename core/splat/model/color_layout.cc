#include "core/splat/model/color_layout.h"

#include <algorithm>

#include "core/color/lab.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {

int ColorLayout::Coefficients(int channel) const {
  return ShCoefficients(channel == 0 ? sh_degree : chroma_sh_degree);
}

int ColorLayout::Row(int channel) const {
  return kColorRow + (channel == 0 ? 0 : Coefficients(0) + (channel - 1) * Coefficients(1));
}

int ColorLayout::rows() const { return Row(channels - 1) + Coefficients(channels - 1); }

float ColorLayout::Base(int channel) const {
  return space == ColorSpace::kLab && channel > 0 ? kNeutralChroma : 0.5f;
}

ColorSpec ColorLayout::Spec(int active_degree) const {
  ColorSpec spec;
  spec.channels = channels;
  for (int c = 0; c < channels; ++c) {
    spec.channel[c] = {Row(c),
                       std::min(Coefficients(c), ShCoefficients(active_degree)),
                       Base(c),
                       space == ColorSpace::kSrgb || c == 0};
  }
  return spec;
}

ColorLayout LayoutOf(const GaussianModel& model) {
  return {model.color_space, model.channels, model.sh_degree, model.chroma_sh_degree};
}

}  // namespace color3d
