#include "server/planning/time_budget.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "core/catalogue/stages.h"
#include "proto/option_text.h"
#include "server/service_error.h"

namespace color3d {
namespace {

// Measured at 500 px on two cores (tests/bench/RESULTS.md "Scenes end to end").
constexpr double kBaseSeconds = 6.0;
constexpr double kSecondsPerPhoto = 1.7;  // carries into and colours one view, renders, evaluates
constexpr double kPosesSecondsPerPhoto = 0.6;  // structure-from-motion
constexpr double kMinScheduledSeconds = 15.0;  // below this the pictures are not worth having

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
  if (rest < kMinScheduledSeconds) {
    throw ServiceError(
        ErrorCode::kInvalidArgument,
        "BAD_OPTION",
        fmt::format(
            "time_budget_seconds is {:.0f}, but {} photos take about {:.0f} s in stages that "
            "cannot be shortened{}; give at least {:.0f} s, or fewer photos",
            std::ceil(seconds),
            facts.photos,
            std::ceil(fixed),
            facts.has_poses ? "" : " (finding their poses among them)",
            std::ceil(fixed + kMinScheduledSeconds)),
        {{fmt::format("spec.{}.time_budget_seconds", kind::kColorizeScene),
          "too short for this scene"}});
  }
  if (facts.is_splat) {  // its geometry is there
    return {0.0, (kGeometryShare + kPersonalizeShare) * rest, kChromaShare * rest};
  }
  return {kGeometryShare * rest, kPersonalizeShare * rest, kChromaShare * rest};
}

void ApplyTimeBudget(const TimeBudget& budget, v1::JobSpec* spec) {
  const auto limit = [](auto* options, double seconds) {
    if (options->has_time_limit_seconds()) return;
    const auto* field = options->GetDescriptor()->FindFieldByName("time_limit_seconds");
    options->set_time_limit_seconds(std::min(seconds, InfoOf(field).max()));
  };
  if (spec->has_reconstruct_geometry()) {
    limit(spec->mutable_reconstruct_geometry(), budget.geometry_seconds);
  } else if (spec->has_personalize()) {
    limit(spec->mutable_personalize(), budget.personalize_seconds);
  } else if (spec->has_solve_chroma()) {
    limit(spec->mutable_solve_chroma(), budget.chroma_seconds);
  }
}

}  // namespace color3d
