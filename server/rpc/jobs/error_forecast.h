// Expected error of a planned run for several time budgets (core/METHOD.md, "Plan and error of a
// run"). Reads the store; no state.
#pragma once

#include <optional>
#include <string>

#include "color3d/v1/job.pb.h"
#include "core/catalogue/error_model.h"
#include "server/planning/scene_facts.h"
#include "server/store/client_store.h"
#include "server/store/project_store.h"

namespace color3d {

// Error of a scene with full schedules, as far as it is known before the run.
struct ErrorForecast {
  ErrorInterval error;
  v1::ErrorBasis basis = v1::ERROR_BASIS_OTHER_SCENES;
  std::string job;  // earlier run; empty: none
};

// From the newest finished run of the spec's scene with as many key views and the same first one,
// if it is given; else from other scenes. Requires: the spec is a colorize_scene job.
ErrorForecast ForecastError(const v1::JobSpec& spec, const ProjectStore& store);

// Fills the budgets and their errors in a plan made of `graph`. Leaves them empty if no colorizer
// is trained or the frames are not counted yet. Schedules are given the plan's machine factor.
void AddBudgetErrors(const ErrorForecast& forecast,
                     const v1::JobSpec& spec,
                     const NewGraph& graph,
                     const SceneFacts& facts,
                     const v1::ImportSceneSpec& import,
                     v1::JobPlan* plan);

}  // namespace color3d
