#include "core/splat/chroma/chroma_parameters.h"

#include <algorithm>
#include <cmath>

#include "core/color/lab.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {

ChromaParameters ChromaParameters::From(const GaussianModel& geometry, int chroma_sh_degree) {
  const ParameterBlock from = ParametersFromModel(geometry);
  const int chroma = ShCoefficients(chroma_sh_degree);
  ChromaParameters p;
  p.block = ParameterBlock(kColorRow + 2 * chroma, from.count());
  for (int r = 0; r < kColorRow; ++r) std::copy_n(from.Row(r), from.count(), p.block.Row(r));
  p.color.channels = 2;
  p.color.channel[0] = {kColorRow, chroma, kNeutralChroma, false};
  p.color.channel[1] = {kColorRow + chroma, chroma, kNeutralChroma, false};
  return p;
}

GaussianModel ChromaParameters::ToModel(const GaussianModel& geometry) const {
  GaussianModel model = geometry;
  const int chroma = coefficients();
  model.channels = 3;
  model.color_space = ColorSpace::kLab;
  model.chroma_sh_degree = static_cast<int>(std::lround(std::sqrt(chroma))) - 1;
  model.sh_a.resize(model.size() * chroma);
  model.sh_b.resize(model.size() * chroma);
  for (size_t i = 0; i < model.size(); ++i) {
    for (int k = 0; k < chroma; ++k) {
      model.sh_a[i * chroma + k] = Row(0, k)[i];
      model.sh_b[i * chroma + k] = Row(1, k)[i];
    }
  }
  return model;
}

}  // namespace color3d
