// Plans the graph of jobs for a submitted spec. Uses no store and no clock.
#pragma once

#include <vector>

#include "color3d/v1/job.pb.h"
#include "server/planning/scene_facts.h"
#include "server/store/client_store.h"

namespace color3d {

// Returns the graph; its last job is the submitted one. `inputs`: the jobs in spec.inputs, with
// their children. Throws what CheckSpec and DivideTimeBudget throw; kFailedPrecondition
// (INPUT_MISSING) with an artifact that nothing provides; kInvalidArgument for inputs of another
// scene and for two jobs of one kind.
NewGraph PlanJob(v1::JobSpec spec, const std::vector<JobRecord>& inputs, const SceneFacts& facts);

}  // namespace color3d
