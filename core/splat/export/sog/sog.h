// PlayCanvas' SOG, version 2: a zip of meta.json and lossless WebP pictures with a pixel for each
// Gaussian, an order of magnitude smaller than a PLY. A pure function.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/parallel.h"
#include "core/splat/export/viewer_gaussians.h"

namespace color3d {

// Gaussians are in Morton order. Positions keep 16 bits of sign(x) ln(1 + |x|) within the scene's
// box, rotations 8 bits a component, opacities 8 bits; scales and colours use 256 values each, and
// rows of higher harmonics are replaced by the nearest row of a palette. The bytes do not depend on
// the number of threads. An empty model gives a valid file. Throws Error{kInvalidArgument} for
// values that are not finite and for more Gaussians than WebP pictures can hold.
std::string EncodeSog(const ViewerGaussians& gaussians, ThreadPool& pool);

// Order of the file's Gaussians, for data beside the file: entry i is the index in the input of
// EncodeSog of the file's i-th Gaussian. `position`: ViewerGaussians::position.
std::vector<uint32_t> SogOrder(const std::vector<float>& position);

}  // namespace color3d
