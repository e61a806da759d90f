#include "core/splat/training/posed_camera.h"

namespace color3d {

std::vector<PosedCamera> PosedCameras(const Scene& scene,
                                      const ViewImages& images,
                                      const std::vector<int>& views) {
  std::vector<PosedCamera> posed;
  for (const int view : views) {
    posed.push_back({view, images.WorkingCamera(view), scene.views[view].cam_from_world});
  }
  return posed;
}

}  // namespace color3d
