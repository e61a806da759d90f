#include "core/splat/geometry/training_schedule.h"

#include <algorithm>
#include <cmath>

#include "core/base/random.h"
#include "core/splat/model/gaussian_cap.h"
#include "core/splat/model/parameter_block.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/motion/motion.h"

namespace color3d {
namespace {

// An iteration's time at one level against the next coarser one: 4 times the pixels, the same
// number of Gaussians.
constexpr double kCostPerLevel = 2.5;
constexpr int kMinTrainingSidePx = 64;  // coarser levels are not used below this

constexpr double kAccelerationShare = 0.25;  // relative to a step of the velocity
constexpr double kCenterRate = 0.01;         // relative to the interval between time steps

// Number of whole steps of `step`, counted from `from`, before `fraction`.
double StepsDone(double fraction, double from, double step) {
  return std::floor((fraction - from) / step);
}

}  // namespace

double TrainingSchedule::Fraction(int64_t iteration, double elapsed_seconds) const {
  double fraction = options_.iterations > 0
                        ? static_cast<double>(iteration) / static_cast<double>(options_.iterations)
                        : 1.0;
  if (options_.time_limit_seconds > 0.0) {
    fraction = std::max(fraction, elapsed_seconds / options_.time_limit_seconds);
  }
  return std::min(1.0, fraction);
}

int TrainingSchedule::Level(double fraction, const Camera& camera) const {
  int level = fraction < tuning_.half_size_until ? 1 : 0;
  const int side = std::min(camera.width, camera.height);
  while (level > 0 && side >> level < kMinTrainingSidePx) --level;
  return level;
}

int TrainingSchedule::ActiveDegree(double fraction) const {
  const double since = fraction - tuning_.sh_from;
  if (since < 0.0) return 0;
  return static_cast<int>(std::min<double>(options_.sh_degree, 1.0 + since / tuning_.sh_step));
}

double TrainingSchedule::PositionRate(double fraction) const {
  return extent_ * std::exp((1.0 - fraction) * std::log(tuning_.position_rate_first) +
                            fraction * std::log(tuning_.position_rate_last));
}

double TrainingSchedule::DropRate(double fraction, int views) const {
  return tuning_.last_drop_rate * fraction * Sparsity(tuning_.sparse_views, views);
}

std::vector<float> TrainingSchedule::LearningRates(double fraction,
                                                   const ColorLayout& layout) const {
  const ColorSpec active = layout.Spec(ActiveDegree(fraction));
  std::vector<float> rates(layout.rows(), 0.0f);
  const double scale = options_.learning_rate_scale;
  // Grows from 0 to 1 after the end of densification.
  const double settling =
      std::max(0.0, fraction - tuning_.densify_until) / std::max(1e-9, 1.0 - tuning_.densify_until);
  const double fade = scale * std::pow(tuning_.last_rate, settling);
  const auto set = [&](int row, int count, double rate) {
    std::fill_n(rates.begin() + row, count, static_cast<float>(rate));
  };
  set(kPositionRow, 3, scale * PositionRate(fraction));
  set(kLogScaleRow, 3, fade * tuning_.scale_rate);
  set(kRotationRow, 4, fade * tuning_.rotation_rate);
  if (is_relief_) {
    for (const int row : {kPositionRow + 2, kLogScaleRow + 2, kRotationRow + 1, kRotationRow + 2}) {
      set(row, 1, 0.0);
    }
  }
  set(kOpacityRow, 1, fade * tuning_.opacity_rate);
  for (int c = 0; c < layout.channels; ++c) {
    set(layout.Row(c), 1, fade * tuning_.dc_rate);
    set(layout.Row(c) + 1,
        active.channel[c].coefficients - 1,
        fade * tuning_.dc_rate / tuning_.rest_divisor);
  }
  return rates;
}

std::vector<float> TrainingSchedule::MoverRates(double fraction,
                                                const ColorLayout& layout,
                                                double interval) const {
  std::vector<float> rates = LearningRates(fraction, layout);
  for (int c = 0; c < layout.channels; ++c) {
    const int coefficients = layout.Coefficients(c);
    const int kept = std::min(coefficients, ShCoefficients(tuning_.mover_sh_degree));
    std::fill_n(rates.begin() + layout.Row(c) + kept, coefficients - kept, 0.0f);
  }
  const auto first = static_cast<int>(rates.size());
  rates.resize(first + kMotionRows, 0.0f);
  const double scale = options_.learning_rate_scale;
  const auto set = [&](int row, int count, double rate) {
    std::fill_n(rates.begin() + first + row, count, static_cast<float>(rate));
  };
  // Scaled so that a step changes the position one time step away as much as a step of the position
  // does.
  set(kVelocityRow, 3, scale * PositionRate(fraction) / interval);
  set(kAccelerationRow,
      3,
      scale * kAccelerationShare * PositionRate(fraction) / interval / interval);
  set(kSpinRow, 4, scale * tuning_.rotation_rate / interval);
  if (is_relief_) {
    for (const int row : {kVelocityRow + 2, kAccelerationRow + 2, kSpinRow + 1, kSpinRow + 2}) {
      set(row, 1, 0.0);
    }
  }
  set(kCenterRow, 1, scale * kCenterRate * interval);
  set(kLogWidthRow, 1, scale * tuning_.scale_rate);
  return rates;
}

float TrainingSchedule::HiddenTime(int64_t iteration, double interval) const {
  Random random(options_.seed, static_cast<uint64_t>(iteration));
  return random.NextUniform() < tuning_.moment_drop_rate ? static_cast<float>(0.5 * interval)
                                                         : 0.0f;
}

bool TrainingSchedule::DensifyDue(double before, double now) const {
  if (now < tuning_.densify_from || before >= tuning_.densify_until) return false;
  const double step =
      (tuning_.densify_until - tuning_.densify_from) / std::max(1, tuning_.densify_rounds);
  if (!(step > 0.0)) return false;
  return StepsDone(now, tuning_.densify_from, step) > StepsDone(before, tuning_.densify_from, step);
}

bool TrainingSchedule::OpacityResetDue(double before, double now) const {
  const double every = tuning_.opacity_reset_every;
  // Rounding must not move a reset to the next iteration.
  const double slack = HalfAnIteration();
  return every > 0.0 && now < tuning_.densify_until &&
         StepsDone(now, -slack, every) > StepsDone(before, -slack, every);
}

bool TrainingSchedule::HasReset(double fraction) const {
  const double every = tuning_.opacity_reset_every;
  return every > 0.0 && fraction > every + HalfAnIteration();
}

double TrainingSchedule::HalfAnIteration() const { return 0.5 / std::max(1, options_.iterations); }

int64_t TrainingSchedule::AffordableCount(double fraction,
                                          int64_t iteration,
                                          double seconds_per_iteration,
                                          int level,
                                          int64_t count) const {
  if (!(options_.time_limit_seconds > 0.0) || !(seconds_per_iteration > 0.0)) {
    return options_.max_gaussians;
  }
  const double cost = seconds_per_iteration * std::pow(kCostPerLevel, level);
  const double possible = (1.0 - fraction) * options_.time_limit_seconds / cost;
  const double wanted = std::max(1.0,
                                 std::min<double>(tuning_.wanted_iterations, options_.iterations) -
                                     static_cast<double>(iteration));
  const double affordable = static_cast<double>(count) * possible / wanted;
  return std::max(count,
                  static_cast<int64_t>(std::min<double>(affordable, options_.max_gaussians)));
}

}  // namespace color3d
