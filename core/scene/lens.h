// Lens distortion: where a captured photo sees a ray, and the pinhole camera of the undistorted
// picture. Pure functions, float64, thread-safe.
#pragma once

#include <Eigen/Core>

#include "core/scene/camera.h"

namespace color3d {

// Distorts a point of the normalised image plane (x / z, y / z). Brown: OpenCV's rational model;
// fisheye: Kannala & Brandt, theta_d = theta (1 + k1 theta^2 + ... + k4 theta^8).
Eigen::Vector2d Distort(const Distortion& distortion, const Eigen::Vector2d& normalised);

// Pixel at which the photo as captured shows a point of the camera's frame (z > 0).
Eigen::Vector2d ProjectCaptured(const Camera& captured,
                                const Distortion& distortion,
                                const Eigen::Vector3d& in_camera);

// The camera of the undistorted picture: size and principal point as captured, both focal lengths
// times one factor in 0.5..8, the smallest for which every pixel of the undistorted picture lies in
// the photo. So there are no empty borders, no field of view is thrown away without need, and
// without distortion it is the captured camera itself. Throws Error{kInvalidArgument} when there is
// no such factor (the distortion folds the picture over).
Camera UndistortedCamera(const Camera& captured, const Distortion& distortion);

// True when all coefficients of the model are zero or the model is none (fisheye never is: even
// without coefficients it bends straight lines).
bool IsUndistorted(const Distortion& distortion);

}  // namespace color3d
