// Where Gaussians are added, moved and removed while geometry is trained. Internal to the splat
// module. Single-threaded and seeded, so deterministic.
#pragma once

#include <cstdint>

#include "core/base/random.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/raster/projection.h"
#include "core/splat/training/adam.h"

namespace color3d {

// What the strategies change together; moments always have the parameters' shape.
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

struct RelocationOptions {
  double dead_opacity = 0.005;
  int64_t target_count = 0;  // grow to this many
  // 0: sources are drawn by opacity (as published); 1: by mean gradient times opacity.
  double gradient_preference = 0.0;
};

// 3DGS-MCMC (Kheradmand et al. 2024): dead Gaussians move onto live ones and new ones are added
// there; opacity and scale change so that the picture stays the same (their equation 9).
void Relocate(const RelocationOptions& options, DensifyTarget& target);

// Opacity and scale factor of each of `copies` equal Gaussians that together look like one of
// `opacity`.
struct SplitShare {
  double opacity = 0.0;
  double scale = 1.0;
};
SplitShare ShareOf(double opacity, int copies);

// Caps all opacities at `max_opacity` and forgets their moments.
void ResetOpacity(double max_opacity, DensifyTarget& target);

}  // namespace color3d
