// Target chroma of the training views in the kernels' form, checked at the door. Internal to the
// splat module. Not thread-safe.
#pragma once

#include <vector>

#include "core/simd/plane_buffer.h"
#include "core/splat/chroma/chroma_fit.h"

namespace color3d {

struct ChromaPlanes {
  PlaneBuffer ab;          // 2 channels: chroma from neutral, range 1 (Lab units / 255)
  PlaneBuffer weight;      // 1 channel, 0..1
  PlaneBuffer confidence;  // 1 channel, 0..1; zeros when unknown
  bool has_confidence = false;
};

// Reads the target of one view. False when it has none. Throws Error{kInvalidArgument} for another
// size, chroma that is not finite and weights that are not in 0..1, with the view and the pixel.
bool LoadChromaPlanes(const ChromaProblem& problem, const PosedCamera& view, ChromaPlanes* planes);

}  // namespace color3d
