// The small movie inside of view.html: for browsers that cannot draw the scene, for motion that the
// page cannot play, and as the sound of a film (EXPORT.md "Viewer"). For the export stage only.
#pragma once

#include <string>

#include "core/scene/scene.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

struct PageMovie {
  std::string bytes;  // MP4, H.264; empty: none
  bool has_sound = false;
  bool shows_motion = false;  // else the scene stands, and the camera turns
};

// Scenes with times: the film of the key view's camera, with its sound. Others: a turn around the
// key view. Empty where this machine has no encoder, and for pictures that are too narrow. Throws
// Error{kCancelled} and the errors of placing the cameras.
PageMovie MakePageMovie(const Scene& scene, const GaussianModel& model, StageContext& context);

}  // namespace color3d
