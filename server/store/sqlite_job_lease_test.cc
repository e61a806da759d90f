#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <mutex>
#include <set>
#include <thread>

#include "tests/support/service/job_store_fixture.h"

namespace color3d {
namespace {
using SqliteJobLeaseTest = JobStoreTest;

TEST_F(SqliteJobLeaseTest, RefusesWritesWithOldEpoch) {
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
  EXPECT_EQ(ReasonThrown([&] { store_->Heartbeat(old, {}, {}, kLease); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { store_->Peek(old); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { store_->SetCheckpoint(old, {Sha256Hex("x"), 1}); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { FailWith(zombie, ErrorCode::kInternal); }), "LEASE_LOST");
  EXPECT_EQ(ReasonThrown([&] { store_->Release(old, {}); }), "LEASE_LOST");
  EXPECT_TRUE(store_->GetJob(job.name).artifacts.empty());
  Succeed(second, "fresh");
  EXPECT_EQ(store_->GetJob(job.name).artifacts.at(0).name, "fresh");
  EXPECT_EQ(ReasonThrown([&] { Succeed(second, "again"); }), "LEASE_LOST") << "only once";
}

TEST_F(SqliteJobLeaseTest, HeartbeatExtendsLease) {
  CreateSingle();
  const JobRecord job = ClaimOne();
  for (int i = 0; i < 5; ++i) {
    now_ += kLease - 100;
    ProgressRecord progress;
    progress.step = i;
    store_->Heartbeat(LeaseOf(job), progress, {.warnings = {"warned"}}, kLease);
    EXPECT_EQ(store_->ReapExpired(), 0);
  }
  const JobRecord running = store_->GetJob(job.name);
  EXPECT_EQ(running.progress.step, 4);
  EXPECT_EQ(running.usage.warnings, std::vector<std::string>{"warned"});
}

TEST_F(SqliteJobLeaseTest, PoisonJobStopsAfterMaxAttempts) {
  const JobRecord job = CreateSingle();
  for (int attempt = 1; attempt <= 3; ++attempt) {
    EXPECT_EQ(ClaimOne().attempt, attempt);
    now_ += kLease + 1;
    store_->ReapExpired();
    EXPECT_FALSE(attempt < 3 && store_->Claim("w", kLease)) << "back-off";
    now_ += 10'000;
  }
  const JobRecord failed = store_->GetJob(job.name);
  EXPECT_EQ(failed.state, JobState::kFailed);
  EXPECT_EQ(failed.error->reason, "WORKER_LOST");
  EXPECT_FALSE(store_->Claim("w", kLease));
}

TEST_F(SqliteJobLeaseTest, RetriesTransientErrorsOnly) {
  const JobRecord job = CreateSingle();
  FailWith(ClaimOne(), ErrorCode::kUnavailable);
  EXPECT_EQ(StateOf(job.name), JobState::kQueued);
  now_ += 10'000;
  FailWith(ClaimOne(), ErrorCode::kInvalidArgument);
  EXPECT_EQ(StateOf(job.name), JobState::kFailed);
}

TEST_F(SqliteJobLeaseTest, DrainDoesNotCountAttempt) {
  const JobRecord job = CreateSingle();
  for (int i = 0; i < 5; ++i) store_->Release(LeaseOf(ClaimOne()), {});
  EXPECT_EQ(StateOf(job.name), JobState::kQueued);
  EXPECT_EQ(ClaimOne().attempt, 1);
}

TEST_F(SqliteJobLeaseTest, CheckpointSurvivesAttempt) {
  CreateSingle();
  const JobRecord first = ClaimOne();
  EXPECT_FALSE(store_->SetCheckpoint(LeaseOf(first), {Sha256Hex("1"), 10}));
  const auto replaced = store_->SetCheckpoint(LeaseOf(first), {Sha256Hex("2"), 20});
  EXPECT_EQ(replaced.value().sha256, Sha256Hex("1"));
  EXPECT_TRUE(store_->IsReferenced(Sha256Hex("2")));
  EXPECT_FALSE(store_->IsReferenced(Sha256Hex("1")));
  store_->Release(LeaseOf(first), {});
  const JobRecord second = ClaimOne();
  EXPECT_EQ(second.checkpoint.value().sha256, Sha256Hex("2"));
  Succeed(second);
  EXPECT_FALSE(store_->IsReferenced(Sha256Hex("2"))) << "of no more use";
}

TEST_F(SqliteJobLeaseTest, CrashAfterCancelDoesNotResurrect) {
  const JobRecord job = CreateSingle();
  ClaimOne();
  store_->Cancel(job.name, {});
  now_ += kLease + 1;
  store_->ReapExpired();
  EXPECT_EQ(StateOf(job.name), JobState::kCancelled);
}

TEST_F(SqliteJobLeaseTest, DrainEndsCancelledJob) {
  const JobRecord job = CreateSingle();
  const JobRecord running = ClaimOne();
  store_->Cancel(job.name, {});
  store_->Release(LeaseOf(running), {});
  EXPECT_EQ(StateOf(job.name), JobState::kCancelled);
}

TEST_F(SqliteJobLeaseTest, ClaimsByPriorityThenAge) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("a")};
  const JobRecord first = store_->CreateGraph(graph, {}, kNoLimit);
  graph.priority = 5;
  const JobRecord urgent = store_->CreateGraph(graph, {}, kNoLimit);
  EXPECT_EQ(ClaimOne().name, urgent.name);
  EXPECT_EQ(ClaimOne().name, first.name);
}

const auto kAnyJob = [](const JobRecord&) { return true; };

TEST_F(SqliteJobLeaseTest, BatchTakesTurnsBetweenSubmittedJobs) {
  const JobRecord many = store_->CreateGraph(PersonalizeJobs(5), {}, kNoLimit);
  const JobRecord few = store_->CreateGraph(PersonalizeJobs(1), {}, kNoLimit);
  EXPECT_EQ(ClaimOne().parent, many.name);
  const auto next = [&] { return store_->ClaimForBatch("w", kLease, "personalize", kAnyJob); };
  EXPECT_EQ(next()->parent, few.name) << "it has none running yet";
  const auto third = next();
  EXPECT_EQ(third->parent, many.name);
  EXPECT_EQ(third->state, JobState::kRunning);
  EXPECT_EQ(third->attempt, 1);
  EXPECT_FALSE(
      store_->ClaimForBatch("w", kLease, "personalize", [](const JobRecord&) { return false; }));
}

TEST_F(SqliteJobLeaseTest, BatchTakesTurnsBetweenProjects) {
  NewGraph graph = PersonalizeJobs(1);
  graph.project = "a";
  for (int i = 0; i < 10; ++i) store_->CreateGraph(graph, {}, kNoLimit);
  graph.project = "b";
  store_->CreateGraph(graph, {}, kNoLimit);
  EXPECT_EQ(ClaimOne().project, "a");
  const auto next = store_->ClaimForBatch("w", kLease, "personalize", kAnyJob);
  ASSERT_TRUE(next.has_value());
  EXPECT_EQ(next->project, "b");
}

TEST_F(SqliteJobLeaseTest, BatchDoesNotOvertakeOtherKinds) {
  store_->CreateGraph(PersonalizeJobs(2), {}, kNoLimit);
  ClaimOne();
  const JobRecord other = CreateSingle();
  EXPECT_TRUE(store_->ClaimForBatch("w", kLease, "personalize", kAnyJob)) << "it came before";
  store_->CreateGraph(PersonalizeJobs(1), {}, kNoLimit);
  EXPECT_FALSE(store_->ClaimForBatch("w", kLease, "personalize", kAnyJob));
  EXPECT_EQ(ClaimOne().name, other.name);
  EXPECT_TRUE(store_->ClaimForBatch("w", kLease, "personalize", kAnyJob));
}

TEST_F(SqliteJobLeaseTest, JobsThatLostWorkerAreNotBatched) {
  store_->CreateGraph(PersonalizeJobs(1), {}, kNoLimit);
  ClaimOne();
  now_ += kLease + 1;
  EXPECT_EQ(store_->ReapExpired(), 1);
  now_ += 1'000'000;
  EXPECT_FALSE(store_->ClaimForBatch("w", kLease, "personalize", kAnyJob));
  EXPECT_EQ(ClaimOne().attempt, 2);
}

TEST_F(SqliteJobLeaseTest, TwoStoresNeverClaimSameJob) {
  constexpr int kJobs = 60;
  for (int i = 0; i < kJobs; ++i) CreateSingle();
  std::atomic<int> claims{0};
  std::mutex mutex;
  std::set<std::string> names;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      SqliteJobStore own(File(), StoreRole::kWorker, TestClocks());
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

TEST_F(SqliteJobLeaseTest, StageCacheFindsSucceededJobsByKey) {
  CreateSingle();
  const JobRecord job = ClaimOne();
  EXPECT_FALSE(store_->FindStage("key"));
  Publication publication;
  publication.stage_key = "key";
  publication.artifacts = {{"a", {Sha256Hex("a"), 1}, ""}};
  store_->Publish(LeaseOf(job), publication);
  EXPECT_EQ(store_->FindStage("key").value().artifacts.size(), 1u);
  EXPECT_FALSE(store_->FindStage(""));
}

// Prevents opening of files during its lifetime.
class NoFurtherFiles {
 public:
  NoFurtherFiles() {
    ::getrlimit(RLIMIT_NOFILE, &before_);
    const int next = ::dup(0);
    ::close(next);
    rlimit none = before_;
    none.rlim_cur = static_cast<rlim_t>(next);
    ::setrlimit(RLIMIT_NOFILE, &none);
  }
  ~NoFurtherFiles() { ::setrlimit(RLIMIT_NOFILE, &before_); }
  NoFurtherFiles(const NoFurtherFiles&) = delete;
  NoFurtherFiles& operator=(const NoFurtherFiles&) = delete;

 private:
  rlimit before_ = {};
};

// A sandboxed worker may not write the temporary files of SQLite.
TEST_F(SqliteJobLeaseTest, PublishesManyArtifactsWithoutTemporaryFiles) {
  for (const char* film : {"first", "second"}) {
    CreateSingle();
    const JobRecord job = ClaimOne();
    Publication publication;
    for (int i = 0; i < 3000; ++i) {
      const std::string name = "views_ab/" + std::to_string(i);
      publication.artifacts.push_back({name, {Sha256Hex(film + name), 1}, "image/png"});
    }
    {
      const NoFurtherFiles none;
      EXPECT_NO_THROW(store_->Publish(LeaseOf(job), publication)) << film;
    }
    EXPECT_EQ(store_->GetJob(job.name).artifacts.size(), publication.artifacts.size());
  }
}

TEST_F(SqliteJobLeaseTest, DeadWorkersLoseLeasesAtOnce) {
  const JobRecord job = CreateSingle();
  ClaimOne("worker-1-77");
  store_->UpdateWorker({"worker-1-77", 77, job.name, 5, 0});
  ASSERT_EQ(store_->ListWorkers().size(), 1u);
  EXPECT_TRUE(store_->ExpireLeases("worker-2-78").empty());
  EXPECT_EQ(store_->ExpireLeases("worker-1-77"), std::vector<std::string>{job.name});
  EXPECT_EQ(store_->ReapExpired(), 1);
  EXPECT_EQ(StateOf(job.name), JobState::kQueued);
}

}  // namespace
}  // namespace color3d
