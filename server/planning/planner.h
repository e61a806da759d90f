// From a job's spec to the graph of jobs that does it. Pure: no store, no clock.
#pragma once

#include <vector>

#include "color3d/v1/job.pb.h"
#include "server/planning/scene_facts.h"
#include "server/store/job_store.h"

namespace color3d {

// `inputs`: the jobs that spec.inputs names, with their children. The last job of the graph is the
// one that was asked for. Throws what CheckSpec throws; kFailedPrecondition (INPUT_MISSING) naming
// an artifact that nothing provides; kInvalidArgument for inputs of another scene or two jobs that
// give the same artifact; what DivideTimeBudget throws for a budget that this scene cannot meet.
NewGraph PlanJob(const v1::JobSpec& spec,
                 const std::vector<JobRecord>& inputs,
                 const SceneFacts& facts);

}  // namespace color3d
