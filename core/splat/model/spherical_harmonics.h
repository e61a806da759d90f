// Real spherical harmonics up to degree 3 with the sign convention of 3DGS files (Condon-Shortley
// phase in the odd orders), and their derivatives by the direction. Generic in the number type:
// double for the reference; the kernels compile the same text for vectors of floats.
#pragma once

namespace color3d {

inline constexpr int kMaxShCoefficients = 16;
// Y_0, the same in all directions: a coefficient of degree 0 adds this many times itself.
inline constexpr float kShDc = 0.28209479177387814f;  // 1 / (2 sqrt(pi))
constexpr int ShCoefficients(int degree) { return (degree + 1) * (degree + 1); }

#include "core/splat/model/spherical_harmonics-inl.h"

}  // namespace color3d
