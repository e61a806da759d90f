// The rasterizer's slow, readable twin in float64: every pixel visits every Gaussian in depth
// order. Formulas as in the publications (conic by matrix inverse, libm exponentials), not as in
// the fast kernels; the tests compare the two. Also a plain form of the training loss.
#pragma once

#include <vector>

#include "core/splat/loss.h"
#include "core/splat/parameter_block.h"
#include "core/splat/projection.h"

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

// Value of the training loss for planes x, y [channel][y * width + x] (see ImageLoss); `weight` may
// be empty.
double ReferenceLoss(const std::vector<std::vector<double>>& x,
                     const std::vector<std::vector<double>>& y,
                     const std::vector<double>& weight,
                     int width,
                     int height,
                     const LossWeights& weights);

}  // namespace color3d
