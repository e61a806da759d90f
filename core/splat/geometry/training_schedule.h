// Schedule of training: levels of the picture pyramid, spherical harmonics, learning rates,
// densification, all as functions of the completed fraction 0..1. Internal to the splat module.
// Immutable.
#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/camera.h"
#include "core/splat/geometry/geometry_options.h"
#include "core/splat/model/color_layout.h"

namespace color3d {

class TrainingSchedule {
 public:
  // `options` must outlive this object. `extent`: world units. For reliefs, parameters that the one
  // pose does not determine have rates of 0 (GeometryProblem::is_relief).
  TrainingSchedule(const GeometryOptions& options, double extent, bool is_relief = false)
      : options_(options), tuning_(TuningOf(options)), extent_(extent), is_relief_(is_relief) {}
  const GeometryTuning& tuning() const { return tuning_; }

  // The larger of the shares of iterations and of the time limit.
  double Fraction(int64_t iteration, double elapsed_seconds) const;
  // Level of the picture pyramid: 0 is full size.
  int Level(double fraction, const Camera& camera) const;
  int ActiveDegree(double fraction) const;
  double PositionRate(double fraction) const;
  // Share of Gaussians dropped from one picture, for this number of training views.
  double DropRate(double fraction, int views) const;
  // One per parameter row.
  std::vector<float> LearningRates(double fraction, const ColorLayout& layout) const;
  // The same for moving Gaussians, followed by one per row of motion (motion/motion.h); `interval`
  // between time steps in units of t.
  std::vector<float> MoverRates(double fraction, const ColorLayout& layout, double interval) const;
  // Gaussians of time steps nearer than this, in units of t, are omitted from this iteration's
  // picture: half of the interval, at random by the iteration's number, or 0.
  float HiddenTime(int64_t iteration, double interval) const;
  // Returns true if a round of densification falls into (before, now].
  bool DensifyDue(double before, double now) const;
  bool OpacityResetDue(double before, double now) const;
  bool HasReset(double fraction) const;
  // Number of Gaussians for which enough iterations fit into the rest of the time limit, given the
  // current cost with `count` of them at `level`; at least `count`. Unlimited without a time limit.
  int64_t AffordableCount(double fraction,
                          int64_t iteration,
                          double seconds_per_iteration,
                          int level,
                          int64_t count) const;

 private:
  double HalfAnIteration() const;  // as a fraction of the schedule

  const GeometryOptions& options_;
  const GeometryTuning tuning_;
  double extent_;
  bool is_relief_;
};

}  // namespace color3d
