// How a scene stands in the page's world: y up as people mean it, what the key view looks at in the
// origin, the key view's camera two units away from it in front (+z). Pure functions.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// page = scale * (rotation * (scene - center)).
struct Stand {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double scale = 1.0;

  Eigen::Vector3d Apply(const Eigen::Vector3d& scene) const {
    return scale * (rotation * (scene - center));
  }
};

// Unit vector against gravity, as far as cameras tell: the mean of their up vectors, made level
// with their horizons, as people hold cameras. Where those cancel each other (all look straight
// down), against where they look. -y without views.
Eigen::Vector3d UpOf(const std::vector<View>& views);

// `focus`: what the key view looks at, in the scene's units. Throws Error{kInvalidArgument} when it
// is where the camera is.
Stand StandOf(const Scene& scene, int key_view, const Eigen::Vector3d& focus);

// A view's camera in the page's world, axes as in OpenGL: x right, y up, looking along -z.
struct StandingCamera {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // from the camera to the page
  // What it turns around: on its axis, as far away as the focus is.
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
};
StandingCamera CameraOn(const Stand& stand, const View& view);

}  // namespace color3d
