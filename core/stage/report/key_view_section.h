// The report's chapters on key views.
#pragma once

#include <vector>

#include "core/report/report_page.h"
#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// With what the artifacts tell of its choice and of its colour; those that are missing are left
// out. Throws Error{kInvalidArgument} when one is damaged.
ReportKeyView ReportOfKeyView(ReportRow pictures, const StageContext& context);

// The additional key views: the photo, its colours, and their source. Pictures fit within
// `side_px`. Throws Error{kInvalidArgument} when an artifact is damaged.
std::vector<ReportKeyView> ReportOfAdditionalKeyViews(const Scene& scene,
                                                      int side_px,
                                                      const StageContext& context);

}  // namespace color3d
