// The second half of the paper's training: luminance, chroma and geometry together (STILL.md "Joint
// training").
#pragma once

#include "core/scene/scene.h"
#include "core/splat/chroma/chroma_options.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Goes on with the training that reconstruct_geometry left (kWarmUp), on the colours of the views;
// in RGB from the sparse points, by the same options. Writes kJointTraining. The model has no
// confidence. Throws Error{kFailedPrecondition} if there is nothing to go on with.
GaussianModel SolveChromaJointly(const ChromaOptions& options,
                                 const Scene& scene,
                                 int key_view,
                                 StageContext& context);

}  // namespace color3d
