#include "core/stage/sources/focus.h"

#include <utility>
#include <vector>

#include "core/base/median.h"

namespace color3d {

Eigen::Vector3d FocusOf(const View& view, const Camera& camera, const Image& depth) {
  std::vector<double> middle;
  for (int y = depth.height / 4; y < depth.height - depth.height / 4; ++y) {
    for (int x = depth.width / 4; x < depth.width - depth.width / 4; ++x) {
      if (depth.At(0, y, x) > 0.0f) middle.push_back(depth.At(0, y, x));
    }
  }
  const double away = middle.empty() ? 1.0 : Median(std::move(middle));
  return view.cam_from_world.WorldFromCamera(away * camera.Ray(camera.cx, camera.cy));
}

}  // namespace color3d
