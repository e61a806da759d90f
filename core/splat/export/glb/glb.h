// Binary glTF 2.0 with the extension KHR_gaussian_splatting: uncompressed, for mesh and scene
// tools. A pure function.
#pragma once

#include <string>

#include "core/splat/export/viewer_gaussians.h"

namespace color3d {

// Writes one node with one primitive of points, in the frame of `gaussians`; the node rotates them
// by half a turn about x, because glTF has y up and 3DGS files have y down. Throws
// Error{kInvalidArgument} without Gaussians (glTF has no empty accessors), for values that are not
// finite, and for 4 GB or more.
std::string EncodeGlb(const ViewerGaussians& gaussians);

}  // namespace color3d
