// The second half of the paper's training: luminance, chroma and geometry together (GAUSSIANS.md
// "Joint training").
#pragma once

#include "core/scene/scene.h"
#include "core/splat/chroma/chroma_options.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Continues the training of reconstruct_geometry (kWarmUp) on the colours of the views. In RGB:
// trains from the sparse points, by the same options. Writes kJointTraining. The model has no
// confidence. Throws Error{kFailedPrecondition} without kWarmUp.
GaussianModel SolveChromaJointly(const ChromaOptions& options,
                                 const Scene& scene,
                                 int key_view,
                                 StageContext& context);

}  // namespace color3d
