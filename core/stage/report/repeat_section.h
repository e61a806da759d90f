// Facts that are needed to repeat a job. For the report stage only.
#pragma once

#include <string>
#include <vector>

#include "core/report/report_page.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Adds commands, version, seed, digests of the results, and licences of the weights. `keys`: names
// of the key views in the order in which they were given.
void AddHowToRepeat(const std::vector<std::string>& keys,
                    bool has_truth,
                    const StageContext& context,
                    ReportData* data);

}  // namespace color3d
