// Files for viewers: standard 3DGS PLY, and the 32-byte .splat of web viewers. Pure functions.
#pragma once

#include <string>

#include "core/base/parallel.h"
#include "core/splat/export/viewer_gaussians.h"

namespace color3d {

// Binary little-endian PLY bytes with x y z nx ny nz f_dc_* f_rest_* opacity scale_* rot_*. An
// offset not added to the positions is in a header comment "offset x y z". `with_confidence` adds a
// last property "confidence" (the model's; 0 if it has none), which viewers that accept the
// standard properties only may reject. Throws Error{kInvalidArgument} if `rgb` has another number
// of Gaussians.
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
                        const ExportFrame& frame,
                        ThreadPool& pool);

}  // namespace color3d
