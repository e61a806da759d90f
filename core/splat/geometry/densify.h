// Adds and removes Gaussians during training of geometry. Internal to the splat module.
// Single-threaded and seeded, so deterministic.
#pragma once

#include <cstdint>

#include "core/base/random.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/raster/projection.h"
#include "core/splat/training/adam.h"

namespace color3d {

// Parameters and moments; both always have the same shape.
struct DensifyTarget {
  ParameterBlock& parameters;
  AdamMoments& moments;
  DensifyStatistics& statistics;
  Random& random;
};

struct GradientDensifyOptions {
  double gradient_threshold = 2e-4;  // mean |dL/d(u, v)|, NDC units
  double clone_below_scale = 0.0;    // world units: smaller Gaussians are cloned, larger ones split
  double prune_opacity = 0.005;
  double prune_scale = 1e30;  // world units
  int64_t max_gaussians = 0;
};

// Adaptive density control (Kerbl et al. 2023): clones or splits the Gaussians whose mean position
// gradient reaches the threshold, steepest first while `max_gaussians` allows, and prunes.
void DensifyByGradient(const GradientDensifyOptions& options, DensifyTarget& target);

// Removes the least opaque Gaussians beyond `count`. The caller resets the statistics.
void KeepMostOpaque(int64_t count, DensifyTarget& target);

// Caps all opacities at `max_opacity` and resets their moments.
void ResetOpacity(double max_opacity, DensifyTarget& target);

}  // namespace color3d
