// Placement of a scene in the page's world: y up, the focus of the key view at the origin, the
// camera of the key view two units in front of it (+z). Pure functions.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// page = scale * (rotation * (scene - center)).
struct ScenePlacement {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double scale = 1.0;

  Eigen::Vector3d Apply(const Eigen::Vector3d& scene) const {
    return scale * (rotation * (scene - center));
  }
};

// Unit up vector estimated from the cameras: the mean of their up vectors, levelled with their
// horizons. If those cancel out (all cameras look straight down), opposite to the viewing
// direction. -y without views.
Eigen::Vector3d UpVector(const std::vector<View>& views);

// `focus`: the point that the key view looks at, in the scene's units. Throws
// Error{kInvalidArgument} if it is the camera's centre.
ScenePlacement PlaceScene(const Scene& scene, int key_view, const Eigen::Vector3d& focus);

// A view's camera in the page's world, axes as in OpenGL: x right, y up, looking along -z.
struct PageCamera {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // from the camera to the page
  // The centre of orbit: on the camera's axis, at the distance of the focus.
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
};
PageCamera PlaceCamera(const ScenePlacement& placement, const View& view);

}  // namespace color3d
