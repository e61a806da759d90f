// What training does when: levels of the picture pyramid, spherical harmonics, learning rates,
// densification. All as functions of the fraction 0..1 of the schedule that is done. Internal to
// the splat module. Immutable.
#pragma once

#include <cstdint>
#include <vector>

#include "core/scene/camera.h"
#include "core/splat/geometry/geometry_options.h"

namespace color3d {

class TrainingSchedule {
 public:
  // `options` must outlive this object. `extent`: world units. Of a relief, what its one pose does
  // not tell has rates of 0 (GeometryProblem::is_relief).
  TrainingSchedule(const GeometryOptions& options, double extent, bool is_relief = false)
      : options_(options), tuning_(TuningOf(options)), extent_(extent), is_relief_(is_relief) {}
  const GeometryTuning& tuning() const { return tuning_; }

  // The larger of the iterations' and the time limit's share.
  double Fraction(int64_t iteration, double elapsed_seconds) const;
  // Of the picture pyramid: 0 is full size.
  int Level(double fraction, const Camera& camera) const;
  int ActiveDegree(double fraction) const;
  double PositionRate(double fraction) const;
  // Of Gaussians left out of one picture, training on so many views.
  double DropRate(double fraction, int views) const;
  // One per parameter row, for `channels` colour channels of degree options.sh_degree.
  std::vector<float> LearningRates(double fraction, int channels) const;
  // The same for what moves, followed by one per row of motion (motion/motion.h); `interval`
  // between time steps in units of t.
  std::vector<float> MoverRates(double fraction, int channels, double interval) const;
  // What belongs to a nearer moment than this, in units of t, is left out of this iteration's
  // picture: half of the interval at random, as the iteration's number says, or 0.
  float HiddenTime(int64_t iteration, double interval) const;
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

 private:
  const GeometryOptions& options_;
  const GeometryTuning tuning_;
  double extent_;
  bool is_relief_;
};

}  // namespace color3d
