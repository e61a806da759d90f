#include "server/worker/stage_summaries.h"

#include <utility>

#include "core/catalogue/stages.h"
#include "server/planning/job_plan.h"
#include "server/planning/job_spec.h"

namespace color3d {

std::vector<StageSummary> SummarizeStages(const std::vector<JobRecord>& jobs,
                                          const SceneFacts& facts) {
  NewGraph graph;
  v1::ImportSceneSpec import;
  for (const JobRecord& job : jobs) {
    NewJob planned;
    planned.kind = job.kind;
    planned.spec = job.spec;
    if (job.skipped_by_plan) planned.skip_reason = job.skip_reason;
    graph.jobs.push_back(std::move(planned));
    if (job.kind == kind::kImportScene) import = ParseSpec(job.spec, job.name).import_scene();
  }
  const v1::JobPlan plan = DescribeGraph(graph, facts, import, {});
  std::vector<StageSummary> stages;
  for (int i = 0; i < plan.stages_size(); ++i) {
    const JobRecord& job = jobs[static_cast<size_t>(i)];
    stages.push_back({.kind = job.kind,
                      .state = JobStateName(job.state),
                      .skip_reason = job.skip_reason,
                      .seconds = job.usage.seconds,
                      .expected_seconds = plan.stages(i).expected_seconds(),
                      .peak_memory_bytes = job.usage.peak_memory_bytes,
                      .expected_peak_memory_bytes = plan.stages(i).expected_peak_memory_bytes(),
                      .warnings = job.usage.warnings});
  }
  return stages;
}

}  // namespace color3d
