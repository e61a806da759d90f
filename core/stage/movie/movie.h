// A scene along a path of the camera, as a movie or frame by frame. For the render stage only.
#pragma once

#include "core/scene/scene.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/render_options.h"

namespace color3d {

// Leaves artifact::kMovie, artifact::kFrames or both, as `options` say, which name a path. Throws
// Error: kInvalidArgument for a file of cameras that is none, times that the scene does not have
// and pictures that are too small for a movie; kFailedPrecondition when this machine encodes no
// movie.
void RenderMovie(const RenderOptions& options,
                 const Scene& scene,
                 const GaussianModel& model,
                 StageContext& context);

}  // namespace color3d
