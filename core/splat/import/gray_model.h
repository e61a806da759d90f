// Conversion of splats of other programs to luminance Gaussians, the geometry of a scene without
// photos.
#pragma once

#include <cstdint>

#include "core/base/parallel.h"
#include "core/splat/export/viewer_gaussians.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

struct GraySplat {
  GaussianModel model;  // one channel, harmonics of the file's degree, in the file's frame
  int64_t dropped = 0;  // Gaussians with a value that is not a number, left out
  // Root mean square of the colours' distance from grey, weighted by opacity, Lab units; the splat
  // is grey below kColorless.
  double chroma = 0.0;
};
inline constexpr double kColorless = 2.0;

// The luminance of Gaussian i along a direction is that of its colour there; its harmonics are
// fitted over directions spread evenly over the sphere (STILL.md "A splat without photos").
// Preserves the order of the remaining Gaussians. Infinite scales and opacities become very small,
// very large, or solid; rotations of length zero become the identity. Throws
// Error{kInvalidArgument} if no Gaussian remains; `name` is the file's name.
GraySplat GrayModelOf(const ViewerGaussians& splat, const std::string& name, ThreadPool& pool);

}  // namespace color3d
