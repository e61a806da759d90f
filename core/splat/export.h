// Standard 3DGS PLY that any viewer opens: RGB spherical harmonics fitted per Gaussian to our Lab
// colours (Lab -> RGB is non-linear, so coefficients cannot be converted one by one).
#pragma once

#include <string>

#include "core/base/parallel.h"
#include "core/splat/gaussian_model.h"

namespace color3d {

// Binary little-endian PLY bytes with x y z nx ny nz f_dc_* f_rest_* opacity scale_* rot_*.
// `world_offset` is added back to positions. RGB SH have the luminance's degree, fitted by least
// squares on Fibonacci directions.
std::string EncodeGaussianPly(const GaussianModel& model,
                              const Eigen::Vector3d& world_offset,
                              ThreadPool& pool);

}  // namespace color3d
