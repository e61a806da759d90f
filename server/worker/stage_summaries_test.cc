#include "server/worker/stage_summaries.h"

#include <gtest/gtest.h>

#include "server/planning/job_plan.h"
#include "tests/support/service/planned_graphs.h"

namespace color3d {
namespace {

// Children of a graph as the store returns them once they have ended.
std::vector<JobRecord> FinishedChildren(const NewGraph& graph) {
  std::vector<JobRecord> jobs;
  for (size_t i = 0; i + 1 < graph.jobs.size(); ++i) {
    const NewJob& planned = graph.jobs[i];
    JobRecord job = Done(planned.kind);
    job.spec = planned.spec;
    job.skip_reason = planned.skip_reason;
    job.skipped_by_plan = !planned.skip_reason.empty();
    if (job.skipped_by_plan) job.state = JobState::kSkipped;
    job.usage.seconds = static_cast<double>(i);
    job.usage.peak_memory_bytes = static_cast<int64_t>(i);
    jobs.push_back(job);
  }
  return jobs;
}

TEST(StageSummariesTest, HaveSecondsAndMemoryOfPlan) {
  const NewGraph graph = PlanJob(SceneSpec(), {}, kTwentyPhotos);
  const v1::JobPlan plan = DescribeGraph(graph, kTwentyPhotos, {}, {});
  const std::vector<JobRecord> jobs = FinishedChildren(graph);
  const std::vector<StageSummary> stages = SummarizeStages(jobs, kTwentyPhotos);
  ASSERT_EQ(static_cast<int>(stages.size()), plan.stages_size());
  for (size_t i = 0; i < stages.size(); ++i) {
    EXPECT_EQ(stages[i].kind, jobs[i].kind);
    EXPECT_EQ(stages[i].skip_reason, jobs[i].skip_reason);
    EXPECT_EQ(stages[i].seconds, static_cast<double>(i));
    EXPECT_EQ(stages[i].peak_memory_bytes, static_cast<int64_t>(i));
    EXPECT_EQ(stages[i].expected_seconds, plan.stages(static_cast<int>(i)).expected_seconds());
    EXPECT_EQ(stages[i].expected_peak_memory_bytes,
              plan.stages(static_cast<int>(i)).expected_peak_memory_bytes());
  }
  EXPECT_TRUE(SummarizeStages({}, kTwentyPhotos).empty());
}

}  // namespace
}  // namespace color3d
