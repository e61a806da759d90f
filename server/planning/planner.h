// From a job's spec to the graph of jobs that does it. Pure: no store, no clock.
#pragma once

#include <string>
#include <vector>

#include "color3d/v1/job.pb.h"
#include "server/planning/time_budget.h"
#include "server/store/job_store.h"

namespace color3d {

// `inputs`: the jobs that spec.inputs names, with their children. The last job of the graph is the
// one that was asked for. Throws what CheckSpec throws; kFailedPrecondition (INPUT_MISSING) naming
// an artifact that nothing provides; kInvalidArgument for inputs of another scene or two jobs that
// give the same artifact; what DivideTimeBudget throws for a budget that this scene cannot meet.
NewGraph PlanJob(const v1::JobSpec& spec,
                 const std::vector<JobRecord>& inputs,
                 const SceneFacts& facts);

// What the options, the seed and the kind contribute to the stage cache's key: equal bytes, equal
// work. Empty when the job must not be served from the cache or found in it (the report of a
// graph).
struct StageKeyPart {
  std::string bytes;
  // What the bytes name without saying what it is: the caller adds the files' digests and the
  // backends' addresses, so that other weights under an old name are other work.
  std::vector<std::string> models;
  std::vector<std::string> backends;
};
StageKeyPart KeyPartOf(v1::JobSpec spec);

}  // namespace color3d
