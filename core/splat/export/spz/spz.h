// Niantic's SPZ: a byte or two for each number. A pure function.
#pragma once

#include <string>

#include "core/base/parallel.h"
#include "core/splat/export/viewer_gaussians.h"

namespace color3d {

enum class SpzVersion {
  k2 = 2,  // gzip: what older readers and the glTF extension know; rotations of 8 bits a component
  k4 = 4,  // zstd; rotations of 10 bits a component
};

// Gaussians come in Morton order. SPZ looks along -z with y up; ours, as in 3DGS files, along +z
// with y down: y and z change their sign here, and readers that ask for the latter (RDF) get the
// frame of `gaussians` back. Positions have as many of 24 bits behind the point as the scene's size
// leaves, scales 16 steps a factor e between e^-10 and e^5.9, colours and opacities 8 bits, higher
// harmonics -1..1 in steps of 1/16 and 1/8. Throws Error{kInvalidArgument} without Gaussians
// (readers refuse such a file), for values that are not finite, and where most scales or any
// position would not fit.
std::string EncodeSpz(const ViewerGaussians& gaussians, SpzVersion version, ThreadPool& pool);

}  // namespace color3d
