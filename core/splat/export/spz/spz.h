// Niantic's SPZ: one or two bytes per number. A pure function.
#pragma once

#include <string>

#include "core/base/parallel.h"
#include "core/splat/export/viewer_gaussians.h"

namespace color3d {

enum class SpzVersion {
  k2 = 2,  // gzip: supported by older readers and the glTF extension; rotations of 8 bits a
           // component
  k4 = 4,  // zstd; rotations of 10 bits a component
};

// Gaussians are in Morton order. SPZ looks along -z with y up; ours, as in 3DGS files, along +z
// with y down: y and z change sign here, and readers that request the latter (RDF) restore the
// frame of `gaussians`. Positions have as many of 24 bits after the point as the scene's size
// allows, scales 16 steps per factor e between e^-10 and e^5.9, colours and opacities 8 bits,
// higher harmonics -1..1 in steps of 1/16 and 1/8. Throws Error{kInvalidArgument} without Gaussians
// (readers reject such a file), for values that are not finite, and if most scales or any position
// are out of range.
std::string EncodeSpz(const ViewerGaussians& gaussians, SpzVersion version, ThreadPool& pool);

}  // namespace color3d
