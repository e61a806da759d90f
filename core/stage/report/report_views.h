// The views that the report compares. For the report stage only.
#pragma once

#include <vector>

#include "core/report/report_page.h"
#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Held-out views first, then training views, each with its photo in grey, the coloured scene (as
// rendered by an earlier stage, else rendered here from the model), the true colours and the
// colorizer's picture, as far as there are artifacts for them. At most 50 views, evenly spread;
// their pictures are the smaller the more there are. Empty without renders and model.
std::vector<ReportView> ReportViews(const Scene& scene, StageContext& context);

}  // namespace color3d
