// Small queues whose times are known.
#include "tests/bench/scale/queue_simulation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "core/base/error.h"

namespace color3d {
namespace {
using ::testing::HasSubstr;

SimulatedStage Timed(double seconds, std::vector<int> inputs = {}) {
  SimulatedStage stage;
  stage.seconds = seconds;
  stage.inputs = std::move(inputs);
  return stage;
}

// Two seconds, then two branches of three and five, then one: eleven in sum, eight at least.
SimulatedScene Diamond() {
  return {{Timed(2.0), Timed(3.0, {0}), Timed(5.0, {0}), Timed(1.0, {1, 2})}};
}

// Servers without limits, whose work takes no time.
QueueModel IdealModel(SimulatedScene scene, int workers, int64_t scenes) {
  QueueModel model;
  model.workers = workers;
  model.scenes = scenes;
  model.kinds = {std::move(scene)};
  model.writers = model.readers = model.cores = 0;
  model.cache_bytes = int64_t{1} << 40;
  model.poll = 0.01;
  model.progress = 0.0;
  model.retry_pause = 0.0;
  model.preference = 0.0;
  model.restart = 0.0;
  return model;
}

double ShareOf(const QueueResult& result, const std::string& name) {
  for (const ResourceUse& use : result.uses) {
    if (use.name == name) return use.share;
  }
  ADD_FAILURE() << "no resource " << name;
  return 0.0;
}

TEST(QueueSimulationTest, OneWorkerTakesTheSumOfAllTimes) {
  const QueueResult result = SimulateQueue(IdealModel(Diamond(), 1, 20));
  EXPECT_DOUBLE_EQ(result.makespan, 20 * 11.0);
  EXPECT_EQ(result.finished_scenes, 20);
  EXPECT_EQ(result.attempts, 80);
  EXPECT_EQ(result.bottleneck, "workers");
  EXPECT_DOUBLE_EQ(ShareOf(result, "workers"), 1.0);
  EXPECT_DOUBLE_EQ(result.scenes_per_hour, 3600.0 / 11.0);
}

TEST(QueueSimulationTest, ManyWorkersTakeTheLongestPath) {
  const QueueResult result = SimulateQueue(IdealModel(Diamond(), 100, 10));
  EXPECT_NEAR(result.makespan, 2.0 + 5.0 + 1.0, 0.1) << "and pauses of idle workers";
}

TEST(QueueSimulationTest, WithoutLimitsWorkersScale) {
  QueueModel model = IdealModel(Diamond(), 1, 4000);
  model.spread = 0.5;
  const double one = SimulateQueue(model).makespan;
  model.workers = 40;
  EXPECT_NEAR(one / SimulateQueue(model).makespan, 40.0, 0.4);
}

TEST(QueueSimulationTest, OneWriterBoundsTheRateOfJobs) {
  QueueModel model = IdealModel({{Timed(1.0)}}, 1000, 20'000);
  model.writers = 1;
  model.times.claim_write = 0.006;
  model.times.publish_write = 0.004;
  const QueueResult result = SimulateQueue(model);
  EXPECT_NEAR(result.jobs_per_second, 100.0, 2.0) << "and the last claims find no job";
  EXPECT_EQ(result.bottleneck, "database writes");
  EXPECT_NEAR(ShareOf(result, "database writes"), 1.0, 0.01);
  EXPECT_NEAR(result.most_workers, 100.0, 2.0) << "each is busy for a second a job";
}

TEST(QueueSimulationTest, FewerWorkersThanTheWriterFeedsAreNotBound) {
  QueueModel model = IdealModel({{Timed(1.0)}}, 20, 2'000);
  model.writers = 1;
  model.times.claim_write = 0.006;
  model.times.publish_write = 0.004;
  const QueueResult result = SimulateQueue(model);
  EXPECT_EQ(result.bottleneck, "workers");
  EXPECT_GT(result.jobs_per_second, 20.0 / 1.05);
  EXPECT_LT(result.jobs_per_second, 20.0 / 1.01);
  EXPECT_NEAR(result.most_workers, 100.0, 2.0) << "the same limit, seen from below";
}

TEST(QueueSimulationTest, HeartbeatsLoadTheWriter) {
  QueueModel model = IdealModel({{Timed(100.0)}}, 10, 10);
  model.writers = 1;
  model.progress = 1.0;
  model.times.heartbeat_write = 0.01;
  const QueueResult result = SimulateQueue(model);
  EXPECT_NEAR(ShareOf(result, "database writes"), 0.1, 0.01);
  EXPECT_EQ(result.bottleneck, "workers") << "no worker waits for a heartbeat";
}

TEST(QueueSimulationTest, LinkBoundsTheBytes) {
  SimulatedScene scene{{Timed(0.0)}};
  scene.bytes = 1'000'000;
  QueueModel model = IdealModel(scene, 10, 1'000);
  model.link_bytes_per_second = 10e6;
  const QueueResult result = SimulateQueue(model);
  EXPECT_NEAR(result.makespan, 100.0, 0.1);
  EXPECT_EQ(result.bottleneck, "network");
  EXPECT_EQ(result.fetched_bytes, 1'000'000'000);
}

TEST(QueueSimulationTest, CacheReadsASceneOnce) {
  SimulatedScene scene{{Timed(1.0), Timed(1.0, {0}), Timed(1.0, {1})}};
  scene.bytes = 1'000;
  scene.stages[0].output_bytes = 10;
  QueueModel model = IdealModel(scene, 1, 5);
  model.cache_bytes = 2'000;
  EXPECT_EQ(SimulateQueue(model).fetched_bytes, 5 * 1'000);
  model.cache_bytes = 0;
  EXPECT_EQ(SimulateQueue(model).fetched_bytes, 5 * (3 * 1'000 + 10));
}

TEST(QueueSimulationTest, JobsWaitForTheWorkerThatHasTheirBlobs) {
  SimulatedScene scene{{Timed(1.0), Timed(1.0, {0}), Timed(1.0, {1})}};
  scene.bytes = 1'000;
  QueueModel model = IdealModel(scene, 4, 40);
  model.preference = 3.0;
  EXPECT_EQ(SimulateQueue(model).fetched_bytes, 40 * 1'000) << "each scene is read by one worker";
}

TEST(QueueSimulationTest, LostWorkerDelaysItsJobByTheLease) {
  QueueModel model = IdealModel({{Timed(300.0)}}, 1, 1);
  model.losses_per_hour = 15.0;
  model.lease = 1'000.0;
  model.poll = 0.1;
  model.most_losses = 100;
  int64_t lost_attempts = 0;
  for (model.seed = 1; model.seed <= 20; ++model.seed) {
    const QueueResult result = SimulateQueue(model);
    EXPECT_EQ(result.attempts, result.losses + 1);
    // The lease begins with the claim; losses of an idle worker delay nothing.
    EXPECT_NEAR(result.makespan, 300.0 + 1'000.0 * static_cast<double>(result.losses), 1.0)
        << "seed " << model.seed;
    lost_attempts += result.losses;
  }
  EXPECT_GT(lost_attempts, 10);
}

TEST(QueueSimulationTest, PreemptedJobGoesOnFromItsCheckpointAtOnce) {
  SimulatedScene scene{{Timed(300.0)}};
  scene.stages[0].resumes = true;
  QueueModel model = IdealModel(scene, 1, 1);
  model.preemptions_per_hour = 30.0;
  model.progress = model.checkpoint = 1.0;
  int64_t preemptions = 0;
  for (model.seed = 1; model.seed <= 20; ++model.seed) {
    const QueueResult result = SimulateQueue(model);
    EXPECT_EQ(result.finished_scenes, 1) << "no try is lost";
    EXPECT_GE(result.makespan, 300.0 - 0.01);
    EXPECT_LE(result.makespan, 300.01 + 1.02 * static_cast<double>(result.preemptions))
        << "seed " << model.seed;
    preemptions += result.preemptions;
  }
  EXPECT_GT(preemptions, 20);
}

TEST(QueueSimulationTest, JobThatAlwaysLosesItsWorkerFails) {
  QueueModel model = IdealModel(Diamond(), 4, 10);
  model.kinds[0].stages[2].seconds = 1e6;
  model.losses_per_hour = 60.0;
  model.lease = 1.0;
  const QueueResult result = SimulateQueue(model);
  EXPECT_EQ(result.failed_scenes, 10);
  EXPECT_EQ(result.finished_scenes, 0);
}

TEST(QueueSimulationTest, LoadLeavesRoom) {
  QueueModel model = IdealModel(Diamond(), 20, 1'000);
  model.load = 0.5;
  model.poll = 0.1;
  const QueueResult result = SimulateQueue(model);
  EXPECT_NEAR(ShareOf(result, "workers"), 0.5, 0.06);
  EXPECT_LT(result.wait_p99, 1.0);
}

TEST(QueueSimulationTest, SameSeedGivesTheSameResult) {
  QueueModel model = IdealModel(Diamond(), 7, 200);
  model.spread = 0.5;
  model.losses_per_hour = 5.0;
  model.preemptions_per_hour = 5.0;
  model.seed = 11;
  const QueueResult first = SimulateQueue(model), second = SimulateQueue(model);
  EXPECT_EQ(first.makespan, second.makespan);
  EXPECT_EQ(first.events, second.events);
  model.seed = 12;
  EXPECT_NE(first.makespan, SimulateQueue(model).makespan);
}

std::string ComplaintAbout(const QueueModel& model) {
  try {
    SimulateQueue(model);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(QueueSimulationTest, RefusesImpossibleModels) {
  QueueModel model = IdealModel(Diamond(), 0, 1);
  EXPECT_THAT(ComplaintAbout(model), HasSubstr("workers"));
  model = IdealModel(Diamond(), 1, 0);
  EXPECT_THAT(ComplaintAbout(model), HasSubstr("scenes"));
  model = IdealModel({}, 1, 1);
  EXPECT_THAT(ComplaintAbout(model), HasSubstr("stages"));
  model = IdealModel({{Timed(1.0, {0})}}, 1, 1);
  EXPECT_THAT(ComplaintAbout(model), HasSubstr("input"));
  model = IdealModel(Diamond(), 1, 1);
  model.lease = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(ComplaintAbout(model), HasSubstr("number"));
}

}  // namespace
}  // namespace color3d
