// Gaussians as viewer formats store them, in the file's frame. Plain values.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/base/parallel.h"
#include "core/splat/export/rgb_harmonics.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

// Transform of an exported scene: file = scale * scene + offset.
struct ExportFrame {
  double scale = 1.0;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  // Not added to the positions, because float32 cannot represent the sum: the user has to add it.
  Eigen::Vector3d left_out = Eigen::Vector3d::Zero();
};

// The world's units and origin, unless float32 would round positions in them by more than 1e-3 of
// the scene's extent; then another origin.
ExportFrame ExportFrameOf(const Scene& scene);

// Row i of an n-wide buffer is [i*n, (i+1)*n).
struct ViewerGaussians {
  int sh_degree = 0;                 // 0..3
  std::vector<float> position;       // 3: file's units
  std::vector<float> log_scale;      // 3: natural logarithm of the file's units
  std::vector<float> rotation;       // 4: unit quaternion w x y z
  std::vector<float> opacity_logit;  // 1: opacity = sigmoid
  std::vector<float> sh;             // 3 (sh_degree + 1)^2: as RgbHarmonics::sh

  size_t size() const { return opacity_logit.size(); }
};

// Rotations of length zero become the identity. Throws Error{kInvalidArgument} if the sizes of the
// model's buffers disagree or `rgb` has another number of Gaussians.
ViewerGaussians ForViewers(const GaussianModel& model,
                           const RgbHarmonics& rgb,
                           const ExportFrame& frame,
                           ThreadPool& pool);

// Throws Error{kInvalidArgument} with the first value that is not finite, which quantizing formats
// cannot represent.
void CheckFinite(const ViewerGaussians& gaussians);

}  // namespace color3d
