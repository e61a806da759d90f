// The report's section on the key view.
#pragma once

#include "core/report/report_page.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// With what the artifacts tell of its choice and of its colour; those that are missing are left
// out. Throws Error{kInvalidArgument} when one is damaged.
ReportKeyView ReportOfKeyView(ReportRow pictures, const StageContext& context);

}  // namespace color3d
