// The real queue with few jobs: every job runs once, and the simulation of it can be made. No times
// are expected beyond those of the stages, which only wait.
#include "tests/bench/scale/queue_run.h"

#include <gtest/gtest.h>

#include "tests/bench/scale/queue_forecast.h"

namespace color3d {
namespace {

QueueRunOptions ShortRun(bool elsewhere) {
  QueueRunOptions options;
  options.jobs_per_worker = 4;
  options.stage_ms = 100;
  options.elsewhere = elsewhere;
  options.limit_seconds = 120;
  return options;
}

TEST(QueueRunTest, WorkersElsewhereRunAllJobs) {
  const QueueRun run = RunQueue(2, ShortRun(true));
  EXPECT_EQ(run.jobs, 8);
  EXPECT_GE(run.seconds, 4 * 0.1 - 0.01) << "two at a time";
  EXPECT_GE(run.seconds_per_job, 0.1);
  EXPECT_GT(run.server_cpu + run.worker_cpu, 0.0);
}

TEST(QueueRunTest, ForecastOfOneWorkerIsItsRun) {
  const QueueRunOptions options = ShortRun(false);
  const QueueRun run = RunQueue(1, options);
  ServiceTimes database;
  database.claim_write = database.publish_write = 1e-3;
  const QueueModel model = ModelOfRun(run, options, database);
  const double one = Forecast(model, 1, options).makespan;
  EXPECT_NEAR(one, 4 * run.seconds_per_job, 0.1 * one);
  EXPECT_LT(Forecast(model, 2, options).makespan, 1.5 * one) << "twice the jobs";
}

}  // namespace
}  // namespace color3d
