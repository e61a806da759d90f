// The plan of a job in words, seconds and bytes, made from the graph that the planner builds, so
// that plan and jobs agree. Uses no store and no clock; thread-safe.
#pragma once

#include <vector>

#include "color3d/v1/job.pb.h"
#include "server/planning/scene_facts.h"
#include "server/store/client_store.h"

namespace color3d {

// Expected and measured seconds of a finished job of one stage.
struct MeasuredJob {
  double expected_seconds = 0.0;  // by EstimateJobSeconds
  double seconds = 0.0;
};

struct MachineFactor {
  double factor = 1.0;  // seconds on this machine, divided by expected ones
  int jobs = 0;         // that it comes from
};

// Expected seconds of a job of one stage on two cores (core/catalogue/cost_model.h), at most its
// time limit. `stage`: with all options, as in a planned graph. `import`: options of the import of
// its scene.
double EstimateJobSeconds(const v1::JobSpec& stage,
                          const SceneFacts& facts,
                          const v1::ImportSceneSpec& import);

// Median over the jobs that are expected to take a second at least; 1 for fewer than three of them.
// Between 1/20 and 20.
MachineFactor MeasureMachine(const std::vector<MeasuredJob>& jobs);

// Describes every job of the graph but the composite parent.
v1::JobPlan DescribeGraph(const NewGraph& graph,
                          const SceneFacts& facts,
                          const v1::ImportSceneSpec& import,
                          const MachineFactor& machine);

// Sets what each job of the graph needs of a worker: memory, weights, model servers, and the
// encoder that it can share in a batch. Composite jobs need nothing. `facts`: of the graph's scene.
void SetNeeds(const SceneFacts& facts, const v1::ImportSceneSpec& import, NewGraph* graph);

}  // namespace color3d
