// Cameras of the training views. Internal to the splat module.
#pragma once

#include <vector>

#include "core/scene/scene.h"
#include "core/scene/view_images.h"

namespace color3d {

struct PosedCamera {
  int view = 0;  // the argument for picture sources
  Camera camera;
  Pose cam_from_world;
  double time_s = 0.0;  // of the scene
  int shot = 0;         // equal for views of one camera
};

// The given views of `scene` at the working size of `images`.
std::vector<PosedCamera> PosedCameras(const Scene& scene,
                                      const ViewImages& images,
                                      const std::vector<int>& views);

}  // namespace color3d
