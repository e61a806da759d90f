// What training does when: levels of the picture pyramid, spherical harmonics, learning rates,
// densification. All as functions of the fraction 0..1 of the schedule that is done. Internal to
// the splat module. Stateless.
#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/camera.h"
#include "core/splat/training/trainer.h"

namespace color3d {

// How the schedule is spent; times are fractions of it. The defaults are measured.
struct GeometryTuning {
  enum class Strategy { kAdaptive, kRelocate };
  Strategy strategy = Strategy::kAdaptive;
  double quarter_size_until = 0.0;  // train at 1/4, then 1/2 of the working size
  double half_size_until = 0.15;
  double densify_from = 0.05;
  double densify_until = 0.6;
  int densify_rounds = 30;
  double gradient_preference = 1.0;  // RelocationOptions
  double growth_until = 0.5;         // the number of Gaussians reaches its cap here
  bool absolute_gradient = false;  // DensifyStatistics::absolute; thresholds are then about 4 times
                                   // those of the usual criterion
  bool sparse_adam = false;        // only the Gaussians in the picture take part in a step
  bool scheduled_cap = false;      // kAdaptive too may grow no faster than that
  double opacity_reset_every = 0.0;  // 0: never; while densifying
  double prune_scale = 0.0;          // of the extent, after the first opacity reset; 0: never
  double opacity_penalty = 0.005;    // times the mean opacity
  double scale_penalty = 0.005;      // times the mean scale / extent
  double max_needle_ratio = 10.0;    // longest to middle axis; 0: no limit
  double noise = 5e5;                // of 3DGS-MCMC, times the position's learning rate
  double sh_from = 0.15;             // degree 1 begins here
  double sh_step = 0.15;             // and each further degree this much later
  double position_rate_first = 6e-4;
  double position_rate_last = 4e-5;
  double dc_rate = 1e-2;
  double rest_divisor = 10.0;
  double opacity_rate = 0.1;
  double scale_rate = 2e-2;
  double rotation_rate = 4e-3;
  // Under a time limit the number of Gaussians grows only while so many can be hoped for.
  double wanted_iterations = 800;
  double last_rate = 0.2;  // all rates but the position's fall to this multiple after densification
};

// The tuning of options.recipe.
GeometryTuning TuningOf(const GeometryOptions& options);

class TrainingSchedule {
 public:
  // Both must outlive this object. `extent`: world units.
  TrainingSchedule(const GeometryOptions& options, const GeometryTuning& tuning, double extent)
      : options_(options), tuning_(tuning), extent_(extent) {}

  // The larger of the iterations' and the time limit's share.
  double Fraction(int64_t iteration, double elapsed_seconds) const;
  // Of the picture pyramid: 0 is full size.
  int Level(double fraction, const Camera& camera) const;
  int ActiveDegree(double fraction) const;
  double PositionRate(double fraction) const;
  // One per parameter row, for `channels` colour channels of degree options.sh_degree.
  std::vector<float> LearningRates(double fraction, int channels) const;
  // True when a round of densification falls into (before, now].
  bool DensifyDue(double before, double now) const;
  bool OpacityResetDue(double before, double now) const;
  bool HasReset(double fraction) const;
  // How many Gaussians let the rest of the time limit hold enough iterations, given what one costs
  // now with `count` of them at `level`; at least `count`. No bound without a time limit.
  int64_t AffordableCount(double fraction,
                          int64_t iteration,
                          double seconds_per_iteration,
                          int level,
                          int64_t count) const;
  // Geometric growth from `initial_count` to the cap.
  int64_t TargetCount(double fraction, int64_t initial_count) const;

 private:
  const GeometryOptions& options_;
  const GeometryTuning& tuning_;
  double extent_;
};

}  // namespace color3d
