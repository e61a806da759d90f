// Least-squares RGB spherical harmonics of a Lab Gaussian. Internal to the export.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/splat/gaussian_model.h"

namespace color3d {

// Immutable after construction, so safe to share between threads.
class RgbHarmonicsFitter {
 public:
  explicit RgbHarmonicsFitter(int degree);

  // sRGB (gamut-mapped, 0..1) of Gaussian `index` seen along each direction; one row each.
  Eigen::MatrixX3d Colors(const GaussianModel& model, size_t index) const;
  // Coefficients f with RGB = 0.5 + sum f_k Y_k, one row per coefficient.
  Eigen::MatrixX3d Fit(const Eigen::MatrixX3d& colors) const;
  // Y_k of the directions, for evaluating what Fit returns.
  Eigen::MatrixXd Basis() const { return basis_.leftCols(coefficients_); }

 private:
  int coefficients_;
  std::vector<Eigen::Vector3d> directions_;
  Eigen::MatrixXd basis_;  // directions x 16
  Eigen::MatrixXd solve_;  // coefficients x directions
};

}  // namespace color3d
