// Slow, readable float64 twin of the rasterizer and the training loss, for tests. Every pixel
// visits every Gaussian in depth order. Formulas are those of the publications (conic by matrix
// inverse, libm exponentials); gradients are by automatic differentiation of the projection and the
// plain adjoint of the blending sum.
#pragma once

#include <array>
#include <vector>

#include "core/splat/model/parameter_block.h"
#include "core/splat/raster/raster_camera.h"
#include "core/splat/training/loss.h"

namespace color3d {

// Planar parameters in float64: value(row, i) as in ParameterBlock.
struct ReferenceParameters {
  int rows = 0;
  int count = 0;
  std::vector<double> values;  // [row][i]

  static ReferenceParameters From(const ParameterBlock& parameters);
  double At(int row, int i) const { return values[static_cast<size_t>(row) * count + i]; }
  double& At(int row, int i) { return values[static_cast<size_t>(row) * count + i]; }
};

struct ReferenceImage {
  int width = 0;
  int height = 0;
  std::vector<std::vector<double>> color;  // [channel][y * width + x]
  std::vector<double> opacity;
  std::vector<double> depth;  // alpha-weighted sum of depths, not divided by opacity
};

ReferenceImage ReferenceRender(const ReferenceParameters& parameters,
                               const ColorSpec& color,
                               const RasterCamera& camera,
                               const std::vector<double>& background);

struct ReferencePixel {
  int x = 0, y = 0;
  std::array<double, 3> color{};
  double opacity = 0.0;
  double depth = 0.0;
  // Alpha of a Gaussian lies within the margin of 1/255 or 0.99, or the transmittance within that
  // of 1e-4, so that correct results may differ by rounding.
  bool near_threshold = false;
};

// Fills the pixels at the given (x, y). `margin` is relative (of the natural logarithm).
void ReferenceRenderAt(const ReferenceParameters& parameters,
                       const ColorSpec& color,
                       const RasterCamera& camera,
                       const std::vector<double>& background,
                       double margin,
                       std::vector<ReferencePixel>& pixels);

// Gradient by all parameters of the sum over pixels k and channels c of d_color[k][c] * colour;
// only x and y of the pixels are read.
ReferenceParameters ReferenceGradient(const ReferenceParameters& parameters,
                                      const ColorSpec& color,
                                      const RasterCamera& camera,
                                      const std::vector<double>& background,
                                      const std::vector<ReferencePixel>& pixels,
                                      const std::vector<std::array<double, 3>>& d_color);

// Largest ratio of the eigenvalues of a 2D covariance (dilation included) among the Gaussians in
// front of the near plane; 1 if there are none.
double ReferenceCovarianceCondition(const ReferenceParameters& parameters,
                                    const RasterCamera& camera);

// Value of the training loss for planes x, y [channel][y * width + x] (see ImageLoss); `weight` may
// be empty.
double ReferenceLoss(const std::vector<std::vector<double>>& x,
                     const std::vector<std::vector<double>>& y,
                     const std::vector<double>& weight,
                     int width,
                     int height,
                     const LossWeights& weights);

}  // namespace color3d
