// Which Gaussians a camera sees, and how well. Internal to this folder.
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

// Of the Gaussians that are drawn at all, at most `count`, spread evenly over the file's order.
std::vector<size_t> SpreadSample(const GaussianModel& model, size_t count);

// Not thread-safe.
class SeenGaussians {
 public:
  // `model` must outlive it. `picture`: what the camera will take in the end, px.
  SeenGaussians(const GaussianModel& model, const Camera& picture, ThreadPool& pool);

  struct Measure {
    double seen = 0.0;     // sum over what is seen of opacity x share of its face x sharpness
    double covered = 0.0;  // share of the picture that is not empty
    double near = 0.0;     // share of it that is filled by things much nearer than `focus`
  };
  // `focus`: distance of what the camera is to look at.
  Measure At(const Pose& cam_from_world, double focus);

  // Of these points those that the camera sees unhidden. For points on Gaussians.
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
