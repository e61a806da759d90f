// Renders a scene along a camera path, as a movie or as pictures. For the render stage only.
#pragma once

#include <filesystem>

#include "core/scene/scene.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/render_options.h"

namespace color3d {

// Writes artifact::kMovie, artifact::kFrames or both. Requires: `options` name a path. Throws
// Error: kInvalidArgument for an invalid file of cameras, times outside the scene, and pictures too
// small for a movie; kFailedPrecondition if this machine has no encoder.
void RenderMovie(const RenderOptions& options,
                 const Scene& scene,
                 const GaussianModel& model,
                 StageContext& context);

// Writes the movie alone, to `file`. Returns false if this machine encodes no H.264, which browsers
// play; there may be a file of another codec then. Throws as RenderMovie.
bool RenderMovieFile(const RenderOptions& options,
                     const Scene& scene,
                     const GaussianModel& model,
                     const std::filesystem::path& file,
                     StageContext& context);

}  // namespace color3d
