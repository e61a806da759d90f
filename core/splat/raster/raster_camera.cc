#include "core/splat/raster/raster_camera.h"

#include <cmath>

#include "core/base/error.h"
#include "core/scene/camera.h"

namespace color3d {

RasterCamera MakeRasterCamera(const Camera& camera, const Pose& cam_from_world) {
  RasterCamera c;
  c.width = camera.width;
  c.height = camera.height;
  c.fx = static_cast<float>(camera.fx);
  c.fy = static_cast<float>(camera.fy);
  c.cx = static_cast<float>(camera.cx);
  c.cy = static_cast<float>(camera.cy);
  if (c.width < 1 || c.height < 1 || !(c.fx > 0.0f) || !(c.fy > 0.0f) || !std::isfinite(c.fx) ||
      !std::isfinite(c.fy) || !std::isfinite(c.cx) || !std::isfinite(c.cy)) {
    throw InvalidArgument(
        "camera of {}x{} px with focal lengths {}, {} px cannot be rendered; sizes and focal "
        "lengths must be positive",
        camera.width,
        camera.height,
        camera.fx,
        camera.fy);
  }
  const Eigen::Matrix3d rotation = cam_from_world.rotation.normalized().toRotationMatrix();
  const Eigen::Vector3d center = -(rotation.transpose() * cam_from_world.translation);
  if (!rotation.allFinite() || !center.allFinite()) {
    throw InvalidArgument("camera pose is not finite; check the poses of the scene");
  }
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) c.rotation[3 * a + b] = static_cast<float>(rotation(a, b));
    c.translation[a] = static_cast<float>(cam_from_world.translation[a]);
    c.center[a] = static_cast<float>(center[a]);
  }
  return c;
}

}  // namespace color3d
