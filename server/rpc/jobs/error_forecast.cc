#include "server/rpc/jobs/error_forecast.h"

#include <algorithm>
#include <set>

#include "core/catalogue/stages.h"
#include "server/planning/job_plan.h"
#include "server/planning/job_spec.h"
#include "server/planning/spec_check.h"
#include "server/planning/time_budget.h"

namespace color3d {
namespace {

constexpr double kBudgetsSeconds[] = {30.0, 60.0, 120.0, 300.0};
constexpr ListBudget kRunsBudget{.bytes = int64_t{8} << 20, .spec_bytes = int64_t{64} << 10};

int KeyViewsOf(const v1::ColorizeSceneSpec& scene) {
  return std::max(scene.select_key_view().count(),
                  1 + scene.carry_color().further_key_views_size());
}

// Errors that the stages of a run reported last.
struct RunErrors {
  std::optional<double> score, coverage, validation, disagreement;
};

RunErrors ErrorsOf(const JobRecord& run, const ProjectStore& store) {
  RunErrors errors;
  for (const JobRecord& stage : store.ListChildren(run.name)) {
    const auto take = [&](const char* kind, const char* name, std::optional<double>* to) {
      if (stage.kind == kind && stage.progress.error_name == name) *to = stage.progress.error_value;
    };
    take(kind::kEvaluate, kScoreCurve, &errors.score);
    take(kind::kCarryColor, kCoverageCurve, &errors.coverage);
    take(kind::kPersonalize, kValidationCurve, &errors.validation);
    take(kind::kSolveChroma, kDisagreementCurve, &errors.disagreement);
  }
  return errors;
}

// Seconds of the schedule of a stage in the graph without a time limit; 0 if the stage does not
// run.
double ScheduleSeconds(const char* kind,
                       const NewGraph& graph,
                       const SceneFacts& facts,
                       const v1::ImportSceneSpec& import) {
  for (const NewJob& job : graph.jobs) {
    if (job.kind != kind || !job.skip_reason.empty()) continue;
    v1::JobSpec stage = ParseSpec(job.spec, job.kind);
    if (stage.has_reconstruct_geometry()) {
      stage.mutable_reconstruct_geometry()->clear_time_limit_seconds();
    } else if (stage.has_personalize()) {
      stage.mutable_personalize()->clear_time_limit_seconds();
    }
    return EstimateJobSeconds(stage, facts, import);
  }
  return 0.0;
}

double Share(double given, double needed) {
  return needed > 0.0 ? std::min(1.0, given / needed) : 1.0;
}

}  // namespace

ErrorForecast ForecastError(const v1::JobSpec& spec, const ProjectStore& store) {
  constexpr int kNewestJobs = 200;
  const v1::ColorizeSceneSpec& scene = spec.colorize_scene();
  const int key_views = KeyViewsOf(scene);
  const JobFilter of_scene{.scene = spec.scene()};
  for (const JobRecord& run : store.ListJobs(of_scene, 0, kNewestJobs, kRunsBudget)) {
    if (run.kind != kind::kColorizeScene || run.state != JobState::kSucceeded) continue;
    if (run.spec.empty()) continue;  // too long for the list
    const v1::ColorizeSceneSpec earlier = ParseSpec(run.spec, run.name).colorize_scene();
    if (KeyViewsOf(earlier) != key_views || earlier.key_view() != scene.key_view()) continue;
    const RunErrors errors = ErrorsOf(run, store);
    if (errors.score) {
      return {ExpectFromScore(*errors.score), v1::ERROR_BASIS_SCORE, run.name};
    }
    if (errors.coverage && errors.validation) {
      return {ExpectFromRun({*errors.coverage, *errors.validation, errors.disagreement}),
              v1::ERROR_BASIS_ESTIMATE,
              run.name};
    }
  }
  return {ExpectFromOtherScenes(key_views), v1::ERROR_BASIS_OTHER_SCENES, ""};
}

void AddBudgetErrors(const ErrorForecast& forecast,
                     const v1::JobSpec& spec,
                     const NewGraph& graph,
                     const SceneFacts& facts,
                     const v1::ImportSceneSpec& import,
                     v1::JobPlan* plan) {
  const double factor = plan->machine_factor();
  const double geometry =
      factor * ScheduleSeconds(kind::kReconstructGeometry, graph, facts, import);
  const double personalize = factor * ScheduleSeconds(kind::kPersonalize, graph, facts, import);
  if (personalize == 0.0 || !ViewsOf(facts, import).is_counted) return;
  const double shortest = ShortestTimeBudget(facts, import);
  plan->set_shortest_budget_seconds(shortest);
  plan->set_error_basis(forecast.basis);
  plan->set_error_job(forecast.job);
  std::set<double> budgets(std::begin(kBudgetsSeconds), std::end(kBudgetsSeconds));
  const double asked = spec.colorize_scene().time_budget_seconds();
  if (asked > 0.0) budgets.insert(asked);
  for (const double seconds : budgets) {
    v1::BudgetError* row = plan->add_budget_errors();
    row->set_budget_seconds(seconds);
    row->set_too_short(seconds < shortest);
    if (row->too_short()) continue;
    const TimeBudget budget = DivideTimeBudget(seconds, facts, import);
    const ErrorInterval expected =
        forecast.error.Times(ErrorGrowth({Share(budget.geometry_seconds, geometry),
                                          Share(budget.personalize_seconds, personalize)}));
    row->set_error(expected.error);
    row->set_low(expected.low);
    row->set_high(expected.high);
  }
}

}  // namespace color3d
