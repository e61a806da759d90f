// Errors of the training views other than key views, whose true colours are unused. Constants are
// chosen on them, so that the held-out views remain for the report.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "core/stage/run_stages.h"

namespace color3d {

// Returns the means of ScoreView over these views, and SourceErrors by source for the photos and,
// under "rendered_", for the renders. The scene folder has the true colours. Requires the artifacts
// of colorize_views and solve_chroma.
nlohmann::ordered_json ScoreTrainingViews(StageContext& context);

}  // namespace color3d
