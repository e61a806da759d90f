#include "server/planning/time_budget.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/catalogue/estimates.h"
#include "core/catalogue/film_rate.h"
#include "core/catalogue/stages.h"
#include "proto/option_text.h"
#include "server/base/service_error.h"

namespace color3d {
namespace {

// Measured at 500 px on two cores (tests/bench/RESULTS.md "Still scenes").
constexpr double kBaseSeconds = 6.0;
constexpr double kSecondsPerPhoto = 1.7;  // carrying, colouring, rendering and scoring one view
// Films are coloured along the optical flow: carrying 0.1, colouring 0.3, movie and metrics 0.1.
constexpr double kSecondsPerFrame = 0.5;
constexpr double kMinScheduledSeconds = 15.0;  // with less, the result is of no use

// Shares of the rest, chosen by where the error falls fastest per second.
constexpr double kGeometryShare = 0.25;
constexpr double kPersonalizeShare = 0.70;
constexpr double kChromaShare = 0.05;

bool FindsPoses(const SceneFacts& facts, const v1::ImportSceneSpec& import) {
  return facts.is_film ? import.film_poses() == v1::ImportSceneSpec::FILM_POSES_AUTO
                       : !facts.has_poses;
}

// The frames of video files are not counted before the import.
bool ViewsAreKnown(const SceneFacts& facts) { return facts.photos > 0 || facts.is_splat; }

// Number of views that the import will make.
int ViewsOf(const SceneFacts& facts, const v1::ImportSceneSpec& import) {
  if (facts.is_splat) return import.has_splat_views() ? import.splat_views() : kSplatViews;
  if (!facts.is_film) return facts.photos;
  const double rate = import.has_film_frames_per_second() ? import.film_frames_per_second()
                                                          : kDefaultFramesPerSecond;
  const auto first_from = [&](double time_s) {
    return static_cast<int>(std::clamp(std::ceil(time_s * rate), 0.0, 1.0 * facts.photos));
  };
  const int end = import.has_film_end_s() ? first_from(import.film_end_s()) : facts.photos;
  const int inside = std::max(0, end - first_from(import.film_begin_s()));
  const int stride = std::max(1, import.film_stride());
  return (inside + stride - 1) / stride;
}

std::string TooShort(double seconds, const SceneFacts& facts, const v1::ImportSceneSpec& import) {
  const double fixed = FixedSeconds(facts, import);
  const std::string subject =
      !ViewsAreKnown(facts)
          ? "a film takes, without its frames,"
          : fmt::format("{} {} take", ViewsOf(facts, import), facts.is_film ? "frames" : "photos");
  const char* fewer = !ViewsAreKnown(facts) ? ""
                      : facts.is_film ? ", or fewer frames (film_stride, film_begin_s, film_end_s)"
                                      : ", or fewer photos";
  return fmt::format(
      "time_budget_seconds is {:.0f}, but {} about {:.0f} s in stages that cannot be shortened{}; "
      "give at least {:.0f} s{}",
      std::ceil(seconds),
      subject,
      std::ceil(fixed),
      ViewsAreKnown(facts) && FindsPoses(facts, import) ? " (finding their poses among them)" : "",
      std::ceil(fixed + kMinScheduledSeconds),
      fewer);
}

}  // namespace

double FixedSeconds(const SceneFacts& facts, const v1::ImportSceneSpec& import) {
  const double per_view = (facts.is_film ? kSecondsPerFrame : kSecondsPerPhoto) +
                          (FindsPoses(facts, import) ? kPosesSecondsPerPhoto : 0.0);
  return kBaseSeconds + per_view * ViewsOf(facts, import);
}

TimeBudget DivideTimeBudget(double seconds,
                            const SceneFacts& facts,
                            const v1::ImportSceneSpec& import) {
  const double rest = seconds - FixedSeconds(facts, import);
  if (rest < kMinScheduledSeconds) {
    throw ServiceError(ErrorReason::kBadOption,
                       TooShort(seconds, facts, import),
                       {{fmt::format("spec.{}.time_budget_seconds", kind::kColorizeScene),
                         "too short for this scene"}});
  }
  if (facts.is_splat) {  // the geometry is given
    return {0.0, (kGeometryShare + kPersonalizeShare) * rest, kChromaShare * rest};
  }
  if (facts.is_film && !FindsPoses(facts, import)) {  // nothing is reconstructed
    // The shares of geometry and chroma are kept for frames that are not counted yet.
    return {0.0, ViewsAreKnown(facts) ? rest : kPersonalizeShare * rest, 0.0};
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
