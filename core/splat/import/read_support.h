// Helpers of the readers of this folder.
#pragma once

#include <cmath>
#include <cstdint>
#include <string_view>

#include "core/base/error.h"
#include "core/splat/import/splat_file.h"
#include "core/splat/model/spherical_harmonics.h"

namespace color3d {

// Little-endian; the caller checks the size first.
inline uint32_t LittleEndianAt(std::string_view bytes, size_t at, int width) {
  uint32_t value = 0;
  for (int k = width - 1; k >= 0; --k) value = value << 8u | static_cast<uint8_t>(bytes[at + k]);
  return value;
}

inline void CheckCount(uint64_t count, const SplatSource& source) {
  if (count <= static_cast<uint64_t>(source.max_gaussians)) return;
  throw Error(ErrorCode::kResourceExhausted,
              "{} holds {} Gaussians; at most {} can be processed here; {}",
              source.name,
              count,
              source.max_gaussians,
              source.remedy);
}

inline ViewerGaussians EmptyGaussians(size_t count, int degree) {
  ViewerGaussians g;
  g.sh_degree = degree;
  g.position.resize(3 * count);
  g.log_scale.resize(3 * count);
  g.rotation.resize(4 * count);
  g.opacity_logit.resize(count);
  g.sh.resize(count * static_cast<size_t>(ShCoefficients(degree)) * 3);
  return g;
}

// Logit of an opacity in 0..1 that was rounded to 8 bits; finite for 0 and 1.
inline float LogitOf(float opacity) {
  const float inside = opacity < 1e-6f ? 1e-6f : opacity > 1.0f - 1e-6f ? 1.0f - 1e-6f : opacity;
  return std::log(inside / (1.0f - inside));
}

}  // namespace color3d
