// Compares one picture of the kernels, forward and backward, with the float64 reference.
#pragma once

#include <optional>
#include <string>

#include "core/splat/raster/pipeline.h"
#include "tests/reference/splat.h"
#include "tests/stability/stability_case.h"

namespace color3d {

struct RasterCase {
  ParameterBlock parameters;
  ColorSpec color;
  RasterCamera camera;
  // The expected picture; default: that of the scene above.
  std::optional<ReferenceParameters> truth;
  std::optional<RasterCamera> truth_camera;
  // Relative distance from a threshold below which a pixel is left out.
  double threshold_margin = 1e-4;
  int max_pixels = 4000;   // number of compared pixels, evenly spread
  double condition = 0.0;  // 0: that of the worst 2D covariance
  std::string condition_of = "2D covariance";
  double value_bound = 2e-5;
  double gradient_bound = 1e-3;
};

// Gradients are those of a sum of the compared pixels with random weights in -1..1. An infinite or
// NaN number on the kernels' side makes an error infinite, never NaN.
StabilityResult CompareRaster(const RasterCase& raster_case, ThreadPool& pool);

}  // namespace color3d
