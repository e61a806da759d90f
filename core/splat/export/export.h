// Files for viewers: standard 3DGS PLY, and the 32-byte .splat of web viewers. Pure functions.
#pragma once

#include <string>

#include "core/base/parallel.h"
#include "core/splat/export/rgb_harmonics.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

// Where an exported scene stands: file = scale * scene + offset.
struct ExportFrame {
  double scale = 1.0;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  // Not in the positions, because float32 cannot carry it: the user has to add it to them.
  Eigen::Vector3d left_out = Eigen::Vector3d::Zero();
};

// The world's own units, and its own origin too unless float32 would then round positions by more
// than 1e-3 of the scene's extent.
ExportFrame ExportFrameOf(const Scene& scene);

// Binary little-endian PLY bytes with x y z nx ny nz f_dc_* f_rest_* opacity scale_* rot_*. An
// offset that was left out stands in a header comment "offset x y z". `with_confidence` adds a last
// property "confidence" (the model's; 0 where it has none), which viewers that know only the
// standard list may refuse. Throws Error{kInvalidArgument} when `rgb` is of another number of
// Gaussians.
std::string EncodeGaussianPly(const GaussianModel& model,
                              const RgbHarmonics& rgb,
                              const ExportFrame& frame,
                              ThreadPool& pool,
                              bool with_confidence = false);

// The .splat layout (antimatter15/splat): per Gaussian 3 float32 position, 3 float32 scale, 4 uint8
// RGBA, 4 uint8 rotation (w x y z, 128 + 128 q), largest volume times opacity first, so that a
// viewer may stop loading early. The format has no view dependence: `rgb` gives its degree 0 only.
// Throws as EncodeGaussianPly.
std::string EncodeSplat(const GaussianModel& model,
                        const RgbHarmonics& rgb,
                        const ExportFrame& frame);

}  // namespace color3d
