// Chapters of the report on key views.
#pragma once

#include <string>
#include <vector>

#include "core/report/report_page.h"
#include "core/scene/scene.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Picture for the page, a JPEG within `side_px`.
ReportPicture SmallPicture(const Image& image, std::string caption, int side_px);

// The key view: its choice and the source of its colour, as far as there are artifacts. Throws
// Error{kInvalidArgument} if an artifact is damaged.
ReportKeyView KeyViewChapter(ReportRow pictures, const StageContext& context);

// The additional key views: the photo, its colours, and their source. Pictures fit within
// `side_px`. Throws Error{kInvalidArgument} if an artifact is damaged.
std::vector<ReportKeyView> AdditionalKeyViewChapters(const Scene& scene,
                                                     int side_px,
                                                     const StageContext& context);

}  // namespace color3d
