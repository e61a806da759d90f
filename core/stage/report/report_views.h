// Views in the report. For the report stage only.
#pragma once

#include <vector>

#include "core/report/report_page.h"
#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Held-out views first, then training views, each with its grey photo, the coloured scene (rendered
// by an earlier stage, else here from the model), the true colours and the picture of the
// colorizer, as far as there are artifacts. At most 50 views, evenly spread; pictures are smaller
// the more there are. Empty without renders and model.
std::vector<ReportView> ReportViews(const Scene& scene, StageContext& context);

}  // namespace color3d
