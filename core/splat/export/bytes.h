// Number conversions of viewer file formats.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/splat/model/spherical_harmonics.h"

namespace color3d {

// Rounds to the nearest integer in 0..255.
inline uint8_t Byte(float value) {
  return static_cast<uint8_t>(std::lround(std::clamp(value, 0.0f, 255.0f)));
}
// Bytes of the .splat layout: a harmonic of degree 0, an opacity's logit, a component of a unit
// quaternion.
inline uint8_t ColorByte(float sh) { return Byte(255.0f * (0.5f + kShDc * sh)); }
inline uint8_t OpacityByte(float logit) { return Byte(255.0f / (1.0f + std::exp(-logit))); }
inline uint8_t RotationByte(float q) { return Byte(128.0f + 128.0f * q); }

}  // namespace color3d
