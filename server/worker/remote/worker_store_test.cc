// The calls of workers, on the store itself and from another process.
#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>
#include <thread>

#include "tests/support/service/worker_store_fixture.h"

namespace color3d {
namespace {

INSTANTIATE_TEST_SUITE_P(Stores,
                         WorkerStoreTest,
                         ::testing::Combine(::testing::ValuesIn(StoresToTest()),
                                            ::testing::Values(StorePath::kDirect,
                                                              StorePath::kRemote)),
                         NameOfWorkerStore);

TEST_P(WorkerStoreTest, RefusesWritesWithOldEpoch) {
  const JobRecord job = CreateSingle();
  const JobRecord zombie = ClaimOne("first");
  now_ += kLease + 1;
  EXPECT_EQ(store_->ReapExpired(), 1);
  EXPECT_EQ(StateOf(job.name), JobState::kQueued);
  now_ += 1000;
  const JobRecord second = ClaimOne("second");
  EXPECT_EQ(second.lease_epoch, zombie.lease_epoch + 1);
  EXPECT_EQ(second.attempt, 2);
  const Lease old = LeaseOf(zombie);
  EXPECT_EQ(ReasonThrown([&] { Succeed(zombie, "stale"); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { worker().Heartbeat(old, {}, {}, kLease); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { worker().Peek(old); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { worker().SetCheckpoint(old, {Sha256Hex("x"), 1}); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { FailWith(zombie, ErrorCode::kInternal); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { worker().Release(old, {}); }), "LEASE_LOST");
  EXPECT_TRUE(worker().GetJob(job.name).artifacts.empty());
  Succeed(second, "fresh");
  EXPECT_EQ(worker().GetJob(job.name).artifacts.at(0).name, "fresh");
  EXPECT_EQ(ReasonThrown([&] { Succeed(second, "again"); }), "LEASE_LOST") << "only once";
}

TEST_P(WorkerStoreTest, HeartbeatExtendsLease) {
  CreateSingle();
  const JobRecord job = ClaimOne();
  for (int i = 0; i < 5; ++i) {
    now_ += kLease - 100;
    ProgressRecord progress;
    progress.step = i;
    worker().Heartbeat(LeaseOf(job), progress, {.warnings = {"warned"}}, kLease);
    EXPECT_EQ(store_->ReapExpired(), 0);
  }
  const JobRecord running = worker().GetJob(job.name);
  EXPECT_EQ(running.progress.step, 4);
  EXPECT_EQ(running.usage.warnings, std::vector<std::string>{"warned"});
}

TEST_P(WorkerStoreTest, PoisonJobStopsAfterMaxAttempts) {
  const JobRecord job = CreateSingle();
  for (int attempt = 1; attempt <= 3; ++attempt) {
    EXPECT_EQ(ClaimOne().attempt, attempt);
    now_ += kLease + 1;
    store_->ReapExpired();
    EXPECT_FALSE(attempt < 3 && worker().Claim("w", kLease)) << "back-off";
    now_ += 10'000;
  }
  const JobRecord failed = worker().GetJob(job.name);
  EXPECT_EQ(failed.state, JobState::kFailed);
  EXPECT_EQ(failed.error->reason, "WORKER_LOST");
  EXPECT_FALSE(worker().Claim("w", kLease));
}

TEST_P(WorkerStoreTest, RetriesTransientErrorsOnly) {
  const JobRecord job = CreateSingle();
  FailWith(ClaimOne(), ErrorCode::kUnavailable);
  EXPECT_EQ(StateOf(job.name), JobState::kQueued);
  now_ += 10'000;
  FailWith(ClaimOne(), ErrorCode::kInvalidArgument);
  EXPECT_EQ(StateOf(job.name), JobState::kFailed);
}

TEST_P(WorkerStoreTest, DrainDoesNotCountAttempt) {
  const JobRecord job = CreateSingle();
  for (int i = 0; i < 5; ++i) worker().Release(LeaseOf(ClaimOne()), {});
  EXPECT_EQ(StateOf(job.name), JobState::kQueued);
  EXPECT_EQ(ClaimOne().attempt, 1);
}

TEST_P(WorkerStoreTest, CheckpointSurvivesAttempt) {
  CreateSingle();
  const JobRecord first = ClaimOne();
  EXPECT_FALSE(worker().SetCheckpoint(LeaseOf(first), {Sha256Hex("1"), 10}));
  const auto replaced = worker().SetCheckpoint(LeaseOf(first), {Sha256Hex("2"), 20});
  EXPECT_EQ(replaced.value().sha256, Sha256Hex("1"));
  EXPECT_TRUE(worker().IsReferenced(Sha256Hex("2")));
  EXPECT_FALSE(worker().IsReferenced(Sha256Hex("1")));
  worker().Release(LeaseOf(first), {});
  const JobRecord second = ClaimOne();
  EXPECT_EQ(second.checkpoint.value().sha256, Sha256Hex("2"));
  Succeed(second);
  EXPECT_FALSE(worker().IsReferenced(Sha256Hex("2"))) << "of no more use";
}

TEST_P(WorkerStoreTest, CrashAfterCancelDoesNotResurrect) {
  const JobRecord job = CreateSingle();
  ClaimOne();
  store_->Cancel(job.name, {});
  now_ += kLease + 1;
  store_->ReapExpired();
  EXPECT_EQ(StateOf(job.name), JobState::kCancelled);
}

TEST_P(WorkerStoreTest, DrainEndsCancelledJob) {
  const JobRecord job = CreateSingle();
  const JobRecord running = ClaimOne();
  store_->Cancel(job.name, {});
  worker().Release(LeaseOf(running), {});
  EXPECT_EQ(StateOf(job.name), JobState::kCancelled);
}

TEST_P(WorkerStoreTest, ClaimsByPriorityThenAge) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("a")};
  const JobRecord first = store_->CreateGraph(graph, {}, kNoLimit);
  graph.priority = 5;
  const JobRecord urgent = store_->CreateGraph(graph, {}, kNoLimit);
  EXPECT_EQ(ClaimOne().name, urgent.name);
  EXPECT_EQ(ClaimOne().name, first.name);
}

TEST_P(WorkerStoreTest, ClaimsJobsWhoseModelsItHas) {
  const auto create = [&](std::vector<std::string> models) {
    NewGraph graph;
    graph.scene = "scenes/test";
    graph.jobs = {Job("single")};
    graph.jobs[0].needs.models = std::move(models);
    return store_->CreateGraph(graph, {}, kNoLimit).name;
  };
  for (int i = 0; i < 40; ++i) create({"model clip", "model absent"});
  const std::string wanted = create({"model clip"});
  const std::string plain = create({});
  ClaimTerms terms{.worker = "w", .lease_ms = kLease};
  terms.models = {"model clip", "backend paint"};
  store_->SetHold(Hold::kPaused, true);
  EXPECT_FALSE(worker().Claim(terms));
  store_->SetHold(Hold::kPaused, false);
  const auto job = worker().Claim(terms);
  ASSERT_TRUE(job.has_value());
  EXPECT_EQ(job->name, wanted);
  EXPECT_EQ(job->state, JobState::kRunning);
  EXPECT_EQ(job->spec, "spec of single");
  terms.models.emplace();
  EXPECT_EQ(worker().Claim(terms).value().name, plain);
  EXPECT_FALSE(worker().Claim(terms));
  EXPECT_TRUE(worker().Claim("w", kLease)) << "a worker that lists none has all";
}

// Every field that a worker reads.
TEST_P(WorkerStoreTest, ReadsScenesAndJobsOfTheStore) {
  const SceneRecord scene = worker().GetScene("scenes/test");
  EXPECT_EQ(scene.state, SceneState::kActive);
  EXPECT_EQ(scene.layout, CaptureLayout::kPhotos);
  EXPECT_EQ(scene.photo_count, 1);
  ASSERT_EQ(scene.files.size(), 1u);
  EXPECT_EQ(scene.files[0].path, "a.jpg");
  EXPECT_EQ(scene.files[0].digest.sha256, Sha256Hex("a"));
  const JobRecord root = CreateDiamond();
  const JobRecord import = ClaimOne();
  ProgressRecord progress{3, 7, "half \xff way", "l1", 0.5, 12.0};
  EXPECT_FALSE(worker()
                   .Heartbeat(LeaseOf(import), progress, {1.5, 9, {"careful"}}, kLease)
                   .cancel_requested);
  const JobRecord running = worker().GetJob(import.name);
  EXPECT_EQ(running.progress.step, 3);
  EXPECT_EQ(running.progress.total_steps, 7);
  EXPECT_EQ(running.progress.message, "half ? way");
  EXPECT_EQ(running.progress.error_name, "l1");
  EXPECT_EQ(running.progress.error_value, 0.5);
  EXPECT_EQ(running.progress.eta_seconds, 12.0);
  EXPECT_EQ(running.usage.seconds, 1.5);
  EXPECT_EQ(running.usage.warnings, std::vector<std::string>{"careful"});
  EXPECT_EQ(running.worker, "w");
  Succeed(import);
  const std::vector<JobRecord> inputs = worker().GetInputs(Child(root, "left").id);
  ASSERT_EQ(inputs.size(), 1u);
  EXPECT_EQ(inputs[0].name, import.name);
  ASSERT_EQ(inputs[0].artifacts.size(), 1u);
  EXPECT_EQ(inputs[0].artifacts[0].name, "result");
  EXPECT_EQ(inputs[0].artifacts[0].media_type, "text/plain");
  EXPECT_EQ(inputs[0].artifacts[0].digest.size_bytes, 3);
  FailWith(ClaimOne(), ErrorCode::kInvalidArgument);
  std::set<std::string> ends;
  for (const JobRecord& child : worker().ListChildren(root.name)) {
    ends.insert(child.kind + " " + JobStateName(child.state) +
                (child.error ? " " + child.error->reason + ": " + child.error->message : ""));
  }
  EXPECT_EQ(
      ends,
      (std::set<std::string>{"import SUCCEEDED", "left FAILED TEST: it broke", "right QUEUED"}));
  EXPECT_EQ(ReasonThrown([&] { worker().GetScene("scenes/none"); }), "SCENE_NOT_FOUND");
  EXPECT_EQ(ReasonThrown([&] { worker().GetJob("jobs/none"); }), "JOB_NOT_FOUND");
}

TEST_P(WorkerStoreTest, HeartbeatTellsOfCancellation) {
  const JobRecord job = CreateSingle();
  const Lease lease = LeaseOf(ClaimOne());
  EXPECT_FALSE(worker().Peek(lease).cancel_requested);
  store_->Cancel(job.name, {});
  EXPECT_TRUE(worker().Peek(lease).cancel_requested);
  EXPECT_TRUE(worker().Heartbeat(lease, {}, {}, kLease).cancel_requested);
  worker().Fail(lease, {ErrorCode::kCancelled, "", "cancelled"}, {});
  EXPECT_EQ(StateOf(job.name), JobState::kCancelled);
}

TEST_P(WorkerStoreTest, JoinsEqualWork) {
  CreateSingle();
  const JobRecord second = CreateSingle();
  EXPECT_FALSE(worker().JoinEqual(LeaseOf(ClaimOne()), "key"));
  EXPECT_TRUE(worker().JoinEqual(LeaseOf(ClaimOne()), "key"));
  EXPECT_EQ(StateOf(second.name), JobState::kQueued);
}

const ClaimTerms kBatch{.worker = "w",
                        .lease_ms = kLease,
                        .memory_limit_bytes = 0,
                        .models = {},
                        .batch_kind = "personalize",
                        .batch_group = ""};

TEST_P(WorkerStoreTest, BatchTakesTurnsBetweenSubmittedJobs) {
  const JobRecord many = store_->CreateGraph(PersonalizeJobs(5), {}, kNoLimit);
  const JobRecord few = store_->CreateGraph(PersonalizeJobs(1), {}, kNoLimit);
  EXPECT_EQ(ClaimOne().parent, many.name);
  const auto next = [&] { return worker().Claim(kBatch); };
  EXPECT_EQ(next()->parent, few.name) << "it has none running yet";
  const auto third = next();
  EXPECT_EQ(third->parent, many.name);
  EXPECT_EQ(third->state, JobState::kRunning);
  EXPECT_EQ(third->attempt, 1);
  ClaimTerms other = kBatch;
  other.batch_group = "of another encoder";
  EXPECT_FALSE(worker().Claim(other));
}

TEST_P(WorkerStoreTest, BatchTakesTurnsBetweenProjects) {
  NewGraph graph = PersonalizeJobs(1);
  graph.project = "a";
  for (int i = 0; i < 10; ++i) store_->CreateGraph(graph, {}, kNoLimit);
  graph.project = "b";
  store_->CreateGraph(graph, {}, kNoLimit);
  EXPECT_EQ(ClaimOne().project, "a");
  const auto next = worker().Claim(kBatch);
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->project, "b");
}

TEST_P(WorkerStoreTest, BatchDoesNotOvertakeOtherKinds) {
  store_->CreateGraph(PersonalizeJobs(2), {}, kNoLimit);
  ClaimOne();
  const JobRecord other = CreateSingle();
  EXPECT_TRUE(worker().Claim(kBatch)) << "it came before";
  store_->CreateGraph(PersonalizeJobs(1), {}, kNoLimit);
  EXPECT_FALSE(worker().Claim(kBatch));
  EXPECT_EQ(ClaimOne().name, other.name);
  EXPECT_TRUE(worker().Claim(kBatch));
}

TEST_P(WorkerStoreTest, JobsThatLostWorkerAreNotBatched) {
  store_->CreateGraph(PersonalizeJobs(1), {}, kNoLimit);
  ClaimOne();
  now_ += kLease + 1;
  EXPECT_EQ(store_->ReapExpired(), 1);
  now_ += 1'000'000;
  EXPECT_FALSE(worker().Claim(kBatch));
  EXPECT_EQ(ClaimOne().attempt, 2);
}

TEST_P(WorkerStoreTest, WorkersNeverClaimSameJob) {
  constexpr int kJobs = 60;
  for (int i = 0; i < kJobs; ++i) CreateSingle();
  std::atomic<int> claims{0};
  std::mutex mutex;
  std::set<std::string> names;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      const auto other = OpenOther();  // of another server on the same data
      WorkerStore& own = t < 2 ? worker() : *other;
      while (const auto job = own.Claim("w" + std::to_string(t), kLease)) {
        ++claims;
        std::lock_guard lock(mutex);
        names.insert(job->name);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(claims.load(), kJobs);
  EXPECT_EQ(names.size(), static_cast<size_t>(kJobs));
}

TEST_P(WorkerStoreTest, StageCacheFindsSucceededJobsByKey) {
  CreateSingle();
  const JobRecord job = ClaimOne();
  EXPECT_FALSE(worker().FindStage("key"));
  Publication publication;
  publication.stage_key = "key";
  publication.artifacts = {{"a", {Sha256Hex("a"), 1}, ""}};
  worker().Publish(LeaseOf(job), publication);
  EXPECT_EQ(worker().FindStage("key").value().artifacts.size(), 1u);
  EXPECT_FALSE(worker().FindStage(""));
}

TEST_P(WorkerStoreTest, PublishesManyArtifacts) {
  CreateSingle();
  const JobRecord job = ClaimOne();
  Publication publication;
  for (int i = 0; i < 3000; ++i) {
    const std::string name = "views_ab/" + std::to_string(i);
    publication.artifacts.push_back({name, {Sha256Hex(name), 1}, "image/png"});
  }
  worker().Publish(LeaseOf(job), publication);
  EXPECT_EQ(worker().GetJob(job.name).artifacts.size(), publication.artifacts.size());
}

TEST_P(WorkerStoreTest, DeadWorkersLoseLeasesAtOnce) {
  const JobRecord job = CreateSingle();
  ClaimOne("worker-1-77");
  worker().UpdateWorker({"worker-1-77", 77, job.name, 5, 0});
  ASSERT_EQ(worker().ListWorkers().size(), 1u);
  EXPECT_TRUE(store_->ExpireLeases("worker-2-78").empty());
  EXPECT_EQ(store_->ExpireLeases("worker-1-77"), std::vector<std::string>{job.name});
  EXPECT_EQ(store_->ReapExpired(), 1);
  EXPECT_EQ(StateOf(job.name), JobState::kQueued);
}

}  // namespace
}  // namespace color3d
