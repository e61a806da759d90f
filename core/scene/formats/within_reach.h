// Range check of camera positions, and rotations from matrices, in files. For this folder only.
#pragma once

#include <Eigen/Core>
#include <Eigen/SVD>
#include <string>

#include "core/base/error.h"

namespace color3d {

// Throws Error{kInvalidArgument} that names `place` if a position is so far from the origin that
// sums of coordinates would overflow.
inline void CheckPositionRange(const Eigen::Vector3d& position, const std::string& place) {
  constexpr double kFarthest = 1e100;
  if (position.cwiseAbs().maxCoeff() < kFarthest) return;
  throw InvalidArgument("{}: the camera stands too far away ({:g}, {:g}, {:g})",
                        place,
                        position.x(),
                        position.y(),
                        position.z());
}

// Returns the rotation nearest to `axes`, whose scale is ignored.
inline Eigen::Matrix3d NearestRotation(const Eigen::Matrix3d& axes) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace color3d
