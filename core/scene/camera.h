// Pinhole camera, lens distortion and rigid pose. Conventions as COLMAP: x right, y down, z
// forward; pixel centres at +0.5 (the pixel in the upper left corner covers [0,1]x[0,1]).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>

namespace color3d {

// Undistorted pinhole intrinsics, px.
struct Camera {
  int width = 0;
  int height = 0;
  double fx = 0.0;
  double fy = 0.0;
  double cx = 0.0;
  double cy = 0.0;

  // Returns the same camera for an image resized to width x height px.
  Camera Scaled(int new_width, int new_height) const;
  // Returns the camera scaled so that the longer side is at most max_side_px; the same camera if it
  // already is, or if max_side_px <= 0.
  Camera FitWithin(int max_side_px) const;

  // Projects a point of the camera frame with z > 0. The pixel may lie outside of the picture: see
  // Contains.
  Eigen::Vector2d Project(const Eigen::Vector3d& in_camera) const {
    return {fx * in_camera.x() / in_camera.z() + cx, fy * in_camera.y() / in_camera.z() + cy};
  }
  // Inverse of Project: the point of the camera frame at z = 1 that projects to the pixel. Times a
  // depth, the point at that depth.
  Eigen::Vector3d Ray(double x_px, double y_px) const {
    return {(x_px - cx) / fx, (y_px - cy) / fy, 1.0};
  }
  // Returns true if 0 <= x < width and 0 <= y < height; false for NaN.
  bool Contains(const Eigen::Vector2d& pixel) const {
    return pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() < width && pixel.y() < height;
  }
};

// Camera with an assumed focal length, for pictures without intrinsics: 1.2 of the longer side.
inline Camera GuessedCamera(int width, int height) {
  const double focal = 1.2 * std::max(width, height);
  return {width, height, focal, focal, 0.5 * width, 0.5 * height};
}

// Brown-Conrady (OpenCV order k1 k2 p1 p2 k3 k4 k5 k6) or Kannala-Brandt fisheye (k1..k4).
struct Distortion {
  enum class Model { kNone, kBrown, kFisheye };
  Model model = Model::kNone;
  std::array<double, 8> k{};
};

// x_cam = rotation * x_world + translation.
struct Pose {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d Center() const { return -(rotation.conjugate() * translation); }
  Eigen::Vector3d Apply(const Eigen::Vector3d& world) const {
    return rotation * world + translation;
  }
  // The inverse of Apply.
  Eigen::Vector3d WorldFromCamera(const Eigen::Vector3d& in_camera) const {
    return Center() + rotation.conjugate() * in_camera;
  }
};

}  // namespace color3d
