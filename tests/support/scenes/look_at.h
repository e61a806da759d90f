// Poses of cameras in synthetic scenes.
#pragma once

#include "core/scene/camera.h"

namespace color3d {

// World-to-camera pose of an upright camera at `center` that looks at `target`, with -y up.
// Requires: the view direction is not vertical.
inline Pose LookAt(const Eigen::Vector3d& center, const Eigen::Vector3d& target) {
  const Eigen::Vector3d z = (target - center).normalized();
  const Eigen::Vector3d x = Eigen::Vector3d::UnitY().cross(z).normalized();
  Eigen::Matrix3d cam_from_world;
  cam_from_world << x.transpose(), z.cross(x).transpose(), z.transpose();
  Pose pose;
  pose.rotation = Eigen::Quaterniond(cam_from_world).normalized();
  pose.translation = -(pose.rotation * center);
  return pose;
}

}  // namespace color3d
