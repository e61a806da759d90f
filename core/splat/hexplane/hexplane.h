// Gaussians deformed by feature planes and a network, and the adjoint (DYNAMIC.md "HexPlane").
// Internal to the splat module. Deterministic for every thread count.
#pragma once

#include <vector>

#include "core/base/parallel.h"
#include "core/simd/plane_buffer.h"
#include "core/splat/model/hexplane_field.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {

// A deformation at one time. Referenced arrays have shape.PlaneFloats() and shape.NetworkFloats()
// floats.
struct HexPlaneAt {
  const HexPlaneShape& shape;
  const float* planes;
  const float* network;
  float t;  // HexPlaneShape::UnitTime
};

// Adds the offsets at this time to position, log scale and rotation of all Gaussians of `at`, which
// holds the canonical ones.
void ApplyHexPlanes(const HexPlaneAt& deformation, ThreadPool& pool, ParameterBlock& at);

// Work space of the adjoint, reused between calls.
struct HexPlaneWorkspace {
  // Partial sums over slices of the Gaussians, whose number is fixed for determinism.
  std::vector<AlignedFloats> planes, network;
};

// The adjoint. `gradient` is dL/d(at) on entry and dL/d(canonical) on return. Sets `d_planes` and
// `d_network`, of the sizes of the deformation's arrays.
void ApplyHexPlanesBackward(const HexPlaneAt& deformation,
                            const ParameterBlock& canonical,
                            ThreadPool& pool,
                            HexPlaneWorkspace& workspace,
                            ParameterBlock& gradient,
                            float* d_planes,
                            float* d_network);

}  // namespace color3d
