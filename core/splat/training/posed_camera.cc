#include "core/splat/training/posed_camera.h"

namespace color3d {

std::vector<PosedCamera> PosedCameras(const Scene& scene,
                                      const ViewImages& images,
                                      const std::vector<int>& views) {
  std::vector<PosedCamera> posed;
  for (const int view : views) {
    const View& of = scene.views[view];
    posed.push_back({view,
                     images.WorkingCamera(view),
                     of.cam_from_world,
                     of.time_s(),
                     of.moment ? of.moment->shot : 0});
  }
  return posed;
}

}  // namespace color3d
