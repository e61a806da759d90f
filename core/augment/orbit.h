// Cameras on an orbit around what a scene is about. Pure functions, thread-safe.
#pragma once

#include <Eigen/Core>

#include "core/scene/scene.h"

namespace color3d {

// The point nearest to the optical axes of the training views, when it lies before the key view at
// 1/3 to 3 times `key_depth` (median depth that the key view sees, > 0); otherwise the point of the
// key view's own axis at that depth.
Eigen::Vector3d CenterOfAttention(const Scene& scene, int key, double key_depth);

// Median angle, radians, between the key view and the other training views as seen from `center`,
// kept within what a warp of one picture can bear: 3..12 degrees.
double OrbitAngle(const Scene& scene, int key, const Eigen::Vector3d& center);

// `cam_from_world` turned about `center`: to the camera's right by `azimuth` and up by `elevation`,
// radians, looking at the center as before.
Pose OrbitPose(const Pose& cam_from_world,
               const Eigen::Vector3d& center,
               double azimuth,
               double elevation);

}  // namespace color3d
