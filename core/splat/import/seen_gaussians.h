// Visibility of Gaussians from a camera. Internal to this folder.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "core/base/parallel.h"
#include "core/scene/camera.h"
#include "core/splat/model/gaussian_model.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/raster/pipeline.h"

namespace color3d {

// A Gaussian as an ellipsoid.
struct Ellipsoid {
  Eigen::Vector3d center;
  Eigen::Matrix3d axes;    // columns, the shortest first
  Eigen::Vector3d radius;  // ascending
  double opacity = 0.0;
};
Ellipsoid EllipsoidOf(const GaussianModel& model, size_t i);

// Selects at most `count` of the visible Gaussians, spread evenly over the file's order.
std::vector<size_t> SpreadSample(const GaussianModel& model, size_t count);

// Not thread-safe.
class SeenGaussians {
 public:
  // `model` must outlive it. `picture`: size of the camera's final picture, px.
  SeenGaussians(const GaussianModel& model, const Camera& picture, ThreadPool& pool);

  struct Measure {
    double seen = 0.0;     // sum over visible Gaussians of opacity x share of the face x sharpness
    double covered = 0.0;  // share of the picture that is not empty
    double near = 0.0;     // share of it covered by objects much nearer than `focus`
  };
  // `focus`: distance of the point that the camera looks at.
  Measure At(const Pose& cam_from_world, double focus);

  // Returns the points that the camera sees unoccluded. For points on Gaussians.
  std::vector<char> Visible(const Pose& cam_from_world, const std::vector<Eigen::Vector3d>& points);

 private:
  void Render(const Pose& cam_from_world);
  bool Unhidden(const Eigen::Vector3d& in_camera) const;

  ParameterBlock parameters_;
  Camera picture_, small_;
  std::vector<Ellipsoid> sample_;
  SplatPipeline pipeline_;
  ThreadPool& pool_;
};

}  // namespace color3d
