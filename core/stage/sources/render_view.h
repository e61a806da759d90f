// Renders the Gaussians of a scene as one of its views shows them. Stateless.
#pragma once

#include "core/scene/scene.h"
#include "core/splat/raster/render.h"

namespace color3d {

// At the pose and the time of `view`, with another camera.
inline RenderedView RenderView(const GaussianModel& model,
                               const View& view,
                               const Camera& camera,
                               ThreadPool& pool) {
  return RenderView(model, camera, view.cam_from_world, pool, 0.0f, view.time_s());
}

}  // namespace color3d
