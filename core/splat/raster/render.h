// Rendering of Gaussian models. Stateless except for the pool's threads.
#pragma once

#include "core/base/image.h"
#include "core/base/parallel.h"
#include "core/scene/camera.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

struct RenderedView {
  Image lab;           // 3 channels in Lab units (L 0..100, a, b); 1 channel (L) for channels == 1
  Image depth;         // 1 channel: alpha-weighted mean camera depth, world units; 0 where empty
  Image median_depth;  // 1 channel: depth at which opacity reaches 0.5; 0 if it never does
  Image opacity;       // 1 channel, accumulated alpha 0..1
};

// Background: L' = background_l, neutral chroma. `time_s`: time in the scene; used by dynamic
// scenes only.
RenderedView RenderView(const GaussianModel& model,
                        const Camera& camera,
                        const Pose& cam_from_world,
                        ThreadPool& pool,
                        float background_l = 0.0f,
                        double time_s = 0.0);

}  // namespace color3d
