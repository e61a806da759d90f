// Cameras on an orbit around the centre of a scene. Pure functions, thread-safe.
#pragma once

#include <Eigen/Core>

#include "core/scene/scene.h"

namespace color3d {

// Returns the point nearest to the optical axes of the training views if it lies in front of the
// key view at 1/3 to 3 times `key_depth` (median depth of the key view, > 0), else the point at
// that depth on the key view's axis.
Eigen::Vector3d CenterOfAttention(const Scene& scene, int key, double key_depth);

// Returns the median angle in radians between the key view and the other training views from
// `center`, clamped to 3..12 degrees, the range in which warps look plausible.
double OrbitAngle(const Scene& scene, int key, const Eigen::Vector3d& center);

// Rotates `cam_from_world` about `center`: to the camera's right by `azimuth` and up by
// `elevation`, in radians. The center keeps its place in the picture.
Pose OrbitPose(const Pose& cam_from_world,
               const Eigen::Vector3d& center,
               double azimuth,
               double elevation);

}  // namespace color3d
