#include "server/planning/time_budget.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/catalogue/cost_model.h"
#include "core/catalogue/film_rate.h"
#include "core/catalogue/stages.h"
#include "proto/option_text.h"
#include "server/base/service_error.h"

namespace color3d {
namespace {

// Not in the cost model: the report, and the features that personalization begins with.
constexpr double kBaseSeconds = 5.6;
// Of the preset fast.
constexpr int kAssumedSidePx = 500;
constexpr int kAssumedGaussians = 40'000;
constexpr char kFewerFrames[] = ", or fewer frames (film_stride, film_begin_s, film_end_s)";
constexpr double kMinScheduledSeconds = 15.0;  // with less, the result is of no use

// Shares of the rest, chosen by where the error falls fastest per second.
constexpr double kGeometryShare = 0.25;
constexpr double kPersonalizeShare = 0.70;
constexpr double kChromaShare = 0.05;

// Number of frames that the import will take of a film.
int FramesInRange(const SceneFacts& facts, const v1::ImportSceneSpec& import) {
  const double rate = import.has_film_frames_per_second() ? import.film_frames_per_second()
                                                          : kDefaultFramesPerSecond;
  const auto first_from = [&](double time_s) {
    return static_cast<int>(std::clamp(std::ceil(time_s * rate), 0.0, 1.0 * facts.pictures));
  };
  const int end = import.has_film_end_s() ? first_from(import.film_end_s()) : facts.pictures;
  const int inside = std::max(0, end - first_from(import.film_begin_s()));
  const int stride = std::max(1, import.film_stride());
  return (inside + stride - 1) / stride;
}

}  // namespace

ExpectedViews ViewsOf(const SceneFacts& facts, const v1::ImportSceneSpec& import) {
  const bool is_counted = facts.pictures > 0;
  const CaptureLayoutInfo& layout = InfoOf(facts.layout);
  switch (layout.views) {
    case ViewSource::kSplatRenders:
      return {.count = import.has_splat_views() ? import.splat_views() : kSplatViews,
              .is_counted = true,
              .noun = "views",
              .fewer = ", or fewer views (splat_views)",
              .have_geometry = true};
    case ViewSource::kFrames:
      return {.count = FramesInRange(facts, import),
              .is_counted = is_counted,
              .noun = "frames",
              .fewer = kFewerFrames,
              .kind = KindBeforeImport(facts, import),
              .are_frames = true,
              .are_reconstructed = InfoOf(KindBeforeImport(facts, import)).is_reconstructed};
    case ViewSource::kPhotos:
      break;
  }
  return {
      .count = facts.pictures, .is_counted = is_counted, .kind = KindBeforeImport(facts, import)};
}

namespace {

std::string TooShort(double seconds, const SceneFacts& facts, const v1::ImportSceneSpec& import) {
  const double fixed = FixedSeconds(facts, import);
  const ExpectedViews views = ViewsOf(facts, import);
  return fmt::format(
      "time_budget_seconds is {:.0f}, but {} about {:.0f} s in stages that cannot be shortened{}; "
      "give at least {:.0f} s{}",
      std::ceil(seconds),
      views.is_counted ? fmt::format("{} {} take", views.count, views.noun)
                       : "a film takes, without its frames,",
      std::ceil(fixed),
      views.is_counted && EstimatesPoses(facts, import) ? " (finding their poses among them)" : "",
      ShortestTimeBudget(facts, import),
      views.is_counted ? views.fewer : "");
}

}  // namespace

double FixedSeconds(const SceneFacts& facts, const v1::ImportSceneSpec& import) {
  const ExpectedViews views = ViewsOf(facts, import);
  const StageWork work = {.views = views.count,
                          .megapixels = AssumedMegapixels(kAssumedSidePx, views.are_frames),
                          .gaussians = views.are_reconstructed ? kAssumedGaussians : 0,
                          .kind = views.kind,
                          .estimates_poses = EstimatesPoses(facts, import),
                          .key_view_given = true};
  double seconds = kBaseSeconds;
  for (const Stage& stage : StageCatalogue()) {
    if (!stage.keeps_time_limit) seconds += EstimateSeconds(stage.kind, work);
  }
  return seconds;
}

double ShortestTimeBudget(const SceneFacts& facts, const v1::ImportSceneSpec& import) {
  return std::ceil(FixedSeconds(facts, import) + kMinScheduledSeconds);
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
  const ExpectedViews views = ViewsOf(facts, import);
  if (views.have_geometry) {
    return {0.0, (kGeometryShare + kPersonalizeShare) * rest, kChromaShare * rest};
  }
  if (!views.are_reconstructed) {
    // The shares of geometry and chroma are kept for frames that are not counted yet.
    return {0.0, views.is_counted ? rest : kPersonalizeShare * rest, 0.0};
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
