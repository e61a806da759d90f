// Lens distortion: projection into the captured photo, and the pinhole camera of the undistorted
// picture. Pure functions, float64, thread-safe.
#pragma once

#include <Eigen/Core>

#include "core/scene/camera.h"

namespace color3d {

// Distorts a point of the normalised image plane (x / z, y / z). Brown: OpenCV's rational model;
// fisheye: Kannala & Brandt, theta_d = theta (1 + k1 theta^2 + ... + k4 theta^8).
Eigen::Vector2d Distort(const Distortion& distortion, const Eigen::Vector2d& normalised);

// Projects a point of the camera frame (z > 0) into the photo as captured. Returns the pixel.
Eigen::Vector2d ProjectCaptured(const Camera& captured,
                                const Distortion& distortion,
                                const Eigen::Vector3d& in_camera);

// Camera of the undistorted picture: size and principal point as captured, both focal lengths
// multiplied by the smallest factor in 0.5..8 for which every pixel of the undistorted picture lies
// in the photo. Hence it has no empty borders and the largest possible field of view, and without
// distortion it is the captured camera. Throws Error{kInvalidArgument} if there is no such factor
// (the distortion folds the picture over).
Camera UndistortedCamera(const Camera& captured, const Distortion& distortion);

// Returns true if the model is none or all its coefficients are zero. Always false for fisheye,
// which bends straight lines even without coefficients.
bool IsUndistorted(const Distortion& distortion);

}  // namespace color3d
