// Options of training geometry and its schedule. Plain values. The defaults are those of the
// service's preset "fast".
#pragma once

#include <cstdint>
#include <optional>

#include "core/splat/hexplane/hexplane_tuning.h"

namespace color3d {

// Schedule of a training; times are fractions of it. The defaults are those of Recipe::kColor3d
// with a long schedule, chosen by measurements.
struct GeometryTuning {
  double half_size_until = 0.3;  // trains at half of the working size before
  double densify_from = 0.05;
  double densify_until = 0.6;
  int densify_rounds = 30;
  double opacity_reset_every = 0.0;  // 0: never; while densifying
  double prune_scale = 0.0;  // relative to the extent, after the first opacity reset; 0: never
  double opacity_penalty = 0.005;  // times the mean opacity of static Gaussians
  double scale_penalty = 0.005;    // times their mean scale / extent
  // Share of Gaussians dropped at random, growing from 0, for at most sparse_views views; for more
  // views in inverse proportion to their square.
  double last_drop_rate = 0.2;
  double sparse_views = 12.0;
  double exposure_rate = 0.005;    // learning rate of each photo's gain and offset; 0: none
  double exposure_prior = 5.0;     // times the sum of their squares
  double max_needle_ratio = 10.0;  // longest to middle axis; 0: no limit
  double sh_from = 0.15;           // start of degree 1
  double sh_step = 0.15;           // interval of further degrees
  double position_rate_first = 6e-4;
  double position_rate_last = 4e-5;
  double beta1 = 0.6;  // of Adam; its other constants are the usual ones
  double dc_rate = 1e-2;
  double rest_divisor = 10.0;
  double opacity_rate = 0.1;
  double scale_rate = 2e-2;
  double rotation_rate = 4e-3;
  // With a time limit the number of Gaussians grows only to a count for which enough iterations
  // fit.
  double wanted_iterations = 800;
  // Share of pictures that omit the Gaussians of their own time step, so that Gaussians of adjacent
  // time steps learn to move there.
  double moment_drop_rate = 0.2;
  double least_width = 0.9;    // of a time window, relative to the interval between time steps
  double seed_width = 1.0;     // of the first window
  double share_motion = 0.05;  // ShareMotion, at this interval of iterations; 0: never
  int share_motion_every = 10;
  int motion_neighbors = 24;
  int mover_sh_degree = 0;  // of moving Gaussians, which few views see
  double last_rate = 0.2;  // all rates but the position's fall to this multiple after densification
  HexPlaneTuning hexplane;

  bool operator==(const GeometryTuning&) const = default;
};

// Calls visit(name, value) for every field, in order.
template <class Tuning, class Visit>
void VisitFields(Tuning& tuning, Visit&& visit) {
  visit("half_size_until", tuning.half_size_until);
  visit("densify_from", tuning.densify_from);
  visit("densify_until", tuning.densify_until);
  visit("densify_rounds", tuning.densify_rounds);
  visit("opacity_reset_every", tuning.opacity_reset_every);
  visit("prune_scale", tuning.prune_scale);
  visit("opacity_penalty", tuning.opacity_penalty);
  visit("scale_penalty", tuning.scale_penalty);
  visit("last_drop_rate", tuning.last_drop_rate);
  visit("sparse_views", tuning.sparse_views);
  visit("exposure_rate", tuning.exposure_rate);
  visit("exposure_prior", tuning.exposure_prior);
  visit("max_needle_ratio", tuning.max_needle_ratio);
  visit("sh_from", tuning.sh_from);
  visit("sh_step", tuning.sh_step);
  visit("position_rate_first", tuning.position_rate_first);
  visit("position_rate_last", tuning.position_rate_last);
  visit("beta1", tuning.beta1);
  visit("dc_rate", tuning.dc_rate);
  visit("rest_divisor", tuning.rest_divisor);
  visit("opacity_rate", tuning.opacity_rate);
  visit("scale_rate", tuning.scale_rate);
  visit("rotation_rate", tuning.rotation_rate);
  visit("wanted_iterations", tuning.wanted_iterations);
  visit("moment_drop_rate", tuning.moment_drop_rate);
  visit("least_width", tuning.least_width);
  visit("seed_width", tuning.seed_width);
  visit("share_motion", tuning.share_motion);
  visit("share_motion_every", tuning.share_motion_every);
  visit("motion_neighbors", tuning.motion_neighbors);
  visit("mover_sh_degree", tuning.mover_sh_degree);
  visit("last_rate", tuning.last_rate);
  VisitHexPlaneFields(tuning.hexplane, visit);
}

struct GeometryOptions {
  // kColor3d: coarse to fine, measured on CPUs. kPaper: the schedule of Kerbl et al. 2023.
  enum class Recipe { kColor3d, kPaper };
  Recipe recipe = Recipe::kColor3d;
  // kAuto: motion is detected if views have times. kStill: the scene is static.
  enum class Motion { kAuto, kStill };
  Motion motion = Motion::kAuto;
  // Of dynamic scenes. kWindows: a foreground moves along parabolas. kHexPlane: a field deforms all
  // Gaussians, as in 4D Gaussian splatting.
  enum class Deformation { kWindows, kHexPlane };
  Deformation deformation = Deformation::kWindows;
  bool dense_start = true;  // kColor3d: also start from points of plane sweeps
  int iterations = 1500;    // 0..100000
  // Seconds of training, 0: none, at most 86400. The whole schedule fits into this time or the
  // iterations, whichever ends first; equal inputs give similar results, not equal ones.
  double time_limit_seconds = 0.0;
  int max_gaussians = 40'000;        // hard cap, 1..10,000,000
  int sh_degree = 2;                 // of luminance at the end, 0..3
  double ssim_weight = 0.2;          // lambda of (1 - SSIM), 0..1
  double edge_weight = 1.0;          // of the Charbonnier-Laplacian term, 0..10
  double densify_gradient = 5e-5;    // NDC units, 1e-9..1e9 (3DGS: 2e-4, for 30k iterations)
  double learning_rate_scale = 1.0;  // on all learning rates, 1e-3..1e3
  // Share of the schedule after which training on luminance ends, 0..1; the rest is trained on
  // luminance and chroma (GeometryProblem::start).
  double warm_up = 1.0;
  uint64_t seed = 1;
  std::optional<GeometryTuning> tuning;  // replaces the recipe's, for measurements

  void Validate() const;  // throws Error{kInvalidArgument}
  bool operator==(const GeometryOptions&) const = default;
};

// The tuning of these options: their own, or the recipe's.
GeometryTuning TuningOf(const GeometryOptions& options);

}  // namespace color3d
