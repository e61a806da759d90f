#include "server/planning/time_budget.h"

#include <cmath>
#include <string>

#include "server/service_error.h"

namespace color3d {
namespace {

// Measured at 500 px on two cores (tests/bench/RESULTS.md "Scenes end to end").
constexpr double kBaseSeconds = 6.0;
constexpr double kSecondsPerPhoto = 1.7;  // carries into and colours one view, renders, evaluates
constexpr double kPosesSecondsPerPhoto = 0.6;    // structure-from-motion
constexpr double kLeastScheduledSeconds = 15.0;  // below this the pictures are not worth having

// Of what is left: where the error falls fastest per second.
constexpr double kGeometryShare = 0.25;
constexpr double kPersonalizeShare = 0.70;
constexpr double kChromaShare = 0.05;

}  // namespace

double FixedSeconds(const SceneFacts& facts) {
  const double per_photo = kSecondsPerPhoto + (facts.has_poses ? 0.0 : kPosesSecondsPerPhoto);
  return kBaseSeconds + per_photo * facts.photos;
}

TimeBudget DivideTimeBudget(double seconds, const SceneFacts& facts) {
  const double fixed = FixedSeconds(facts);
  const double rest = seconds - fixed;
  if (rest < kLeastScheduledSeconds) {
    const auto text = [](double s) { return std::to_string(std::lround(std::ceil(s))); };
    throw ServiceError(
        ErrorCode::kInvalidArgument,
        "BAD_OPTION",
        "time_budget_seconds is " + text(seconds) + ", but " + std::to_string(facts.photos) +
            " photos take about " + text(fixed) + " s in stages that cannot be shortened" +
            (facts.has_poses ? "" : " (finding their poses among them)") + "; give at least " +
            text(fixed + kLeastScheduledSeconds) + " s, or fewer photos",
        {{"spec.colorize_scene.time_budget_seconds", "too short for this scene"}});
  }
  return {kGeometryShare * rest, kPersonalizeShare * rest, kChromaShare * rest};
}

}  // namespace color3d
