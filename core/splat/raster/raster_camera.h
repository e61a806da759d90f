// A pinhole camera in the kernels' form. No Eigen here, because the kernels are compiled once per
// instruction set. A plain value.
#pragma once

namespace color3d {

struct Camera;
struct Pose;

// Row-major rotation; x_cam = rotation * x + translation.
struct RasterCamera {
  int width = 0;
  int height = 0;
  float fx = 1.0f;
  float fy = 1.0f;
  float cx = 0.0f;
  float cy = 0.0f;
  float rotation[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  float translation[3] = {0, 0, 0};
  float center[3] = {0, 0, 0};
};

// Throws Error{kInvalidArgument} for a size or focal length that is not positive and for a pose
// that is not finite.
RasterCamera MakeRasterCamera(const Camera& camera, const Pose& cam_from_world);

}  // namespace color3d
