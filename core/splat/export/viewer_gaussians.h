// What every format for viewers says of a Gaussian, in the file's own frame. Plain values.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/base/parallel.h"
#include "core/splat/export/rgb_harmonics.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

// Where an exported scene stands: file = scale * scene + offset.
struct ExportFrame {
  double scale = 1.0;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  // Not in the positions, because float32 cannot carry it: the user has to add it to them.
  Eigen::Vector3d left_out = Eigen::Vector3d::Zero();
};

// The world's own units, and its own origin too unless float32 would then round positions by more
// than 1e-3 of the scene's extent.
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

// A rotation of length zero becomes the identity. Throws Error{kInvalidArgument} when the model's
// buffers do not fit together or `rgb` is of another number of Gaussians.
ViewerGaussians ForViewers(const GaussianModel& model,
                           const RgbHarmonics& rgb,
                           const ExportFrame& frame,
                           ThreadPool& pool);

// Throws Error{kInvalidArgument} that names the first value that is infinite or not a number: what
// quantising formats cannot say.
void CheckFinite(const ViewerGaussians& gaussians);

}  // namespace color3d
