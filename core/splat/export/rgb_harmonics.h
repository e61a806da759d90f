// RGB spherical harmonics of Lab Gaussians, for viewers without Lab. Lab -> RGB is not linear, so
// coefficients cannot be converted one by one; they are fitted per Gaussian here, and may be
// refined against whole pictures (rgb_refine.h).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/base/parallel.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

// Colours only: the geometry is the model's. The colour of Gaussian i along a direction is
// 0.5 + sum over k of Y_k * sh[(i * (degree + 1)^2 + k) * 3 + channel], sRGB 0..1. A plain value.
struct RgbHarmonics {
  int degree = 0;  // 0..3
  std::vector<float> sh;
};

// Immutable after construction, so safe to share between threads.
class RgbHarmonicsFitter {
 public:
  explicit RgbHarmonicsFitter(int degree);

  // sRGB (of Lab models gamut-mapped, 0..1) of Gaussian `index` seen along each direction; one row
  // each.
  Eigen::MatrixX3d Colors(const GaussianModel& model, size_t index) const;
  // Coefficients f with RGB = 0.5 + sum f_k Y_k, one row per coefficient.
  Eigen::MatrixX3d Fit(const Eigen::MatrixX3d& colors) const;
  // Y_k of the directions, to evaluate the result of Fit.
  Eigen::MatrixXd Basis() const { return basis_.leftCols(coefficients_); }
  // The matrix of Fit: coefficients x directions.
  const Eigen::MatrixXd& Solver() const { return solve_; }

 private:
  int coefficients_;
  std::vector<Eigen::Vector3d> directions_;
  Eigen::MatrixXd basis_;  // directions x 16
  Eigen::MatrixXd solve_;  // coefficients x directions
};

// Fits harmonics of the model's largest degree by least squares over directions spread evenly over
// the sphere; those of an sRGB model are its own. Throws Error{kInvalidArgument} if the sizes of
// the model's buffers disagree.
RgbHarmonics FitRgbHarmonics(const GaussianModel& model, ThreadPool& pool);

// The colours without view dependence.
RgbHarmonics DegreeZero(const RgbHarmonics& rgb);

}  // namespace color3d
