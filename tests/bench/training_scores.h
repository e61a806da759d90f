// What constants are chosen on: errors of the training views that are not key views, whose own
// colours nobody has seen. The held-out views stay for the report.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "core/stage/run_stages.h"

namespace color3d {

// Mean over those views of ScoreView's values, and SourceErrors' by source for the photos and,
// under "rendered_", for the renders. The scene folder holds the true colours; needs the artifacts
// of colorize_views and solve_chroma.
nlohmann::ordered_json ScoreTrainingViews(StageContext& context);

}  // namespace color3d
