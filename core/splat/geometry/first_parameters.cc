#include "core/splat/geometry/first_parameters.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/splat/model/model_parameters.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {
namespace {

// Spherical harmonics of `from`, channel by channel, cut or extended to `coefficients` each. A
// single channel serves for all.
ParameterBlock WithColors(const GaussianModel& from, int channels, int coefficients) {
  const ParameterBlock given = ParametersFromModel(from);
  const int first = ShCoefficients(from.sh_degree), other = ShCoefficients(from.chroma_sh_degree);
  ParameterBlock p(kColorRow + channels * coefficients, given.count());
  for (int r = 0; r < kColorRow; ++r) std::copy_n(given.Row(r), given.count(), p.Row(r));
  for (int c = 0; c < channels; ++c) {
    const int source = std::min(c, from.channels - 1);
    const int row = kColorRow + (source == 0 ? 0 : first + (source - 1) * other);
    for (int k = 0; k < std::min(coefficients, source == 0 ? first : other); ++k) {
      std::copy_n(given.Row(row + k), given.count(), p.Row(kColorRow + c * coefficients + k));
    }
  }
  return p;
}

}  // namespace

ParameterBlock FirstParameters(const GaussianModel& from,
                               int channels,
                               int coefficients,
                               int64_t most) {
  ParameterBlock p = WithColors(from, channels, coefficients);
  if (p.count() <= most) return p;
  std::vector<uint32_t> kept(most);
  for (int64_t i = 0; i < most; ++i) kept[i] = static_cast<uint32_t>(i * p.count() / most);
  p.Gather(kept);
  return p;
}

}  // namespace color3d
