// What somebody needs to make a report's scene again. For the report stage only.
#pragma once

#include <string>
#include <vector>

#include "core/report/report_page.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Commands, version, seed, digests of the results, and licences of the weights. `keys`: names of
// the key views, the first one first.
void AddHowToRepeat(const std::vector<std::string>& keys,
                    bool has_truth,
                    const StageContext& context,
                    ReportData* data);

}  // namespace color3d
