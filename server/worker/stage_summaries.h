// Outcome of the stages of a graph, for the report. Pure function.
#pragma once

#include <vector>

#include "core/catalogue/stage_summary.h"
#include "server/planning/scene_facts.h"
#include "server/store/job.h"

namespace color3d {

// One summary for each job, with the seconds that its plan expected. `jobs`: the children of a
// submitted job, in order of creation.
std::vector<StageSummary> SummarizeStages(const std::vector<JobRecord>& jobs,
                                          const SceneFacts& facts);

}  // namespace color3d
