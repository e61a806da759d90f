#include <gtest/gtest.h>

#include <thread>

#include "tests/support/service/any_store_fixture.h"

namespace color3d {
namespace {
class StoreTest : public AnyStoreTest {};
COLOR3D_FOR_ALL_STORES(StoreTest);

TEST_P(StoreTest, RequestIdMakesCallsIdempotent) {
  const RequestKey key{"CreateJob", "id-1", "body-1"};
  const JobRecord first = CreateDiamond(key);
  EXPECT_EQ(CreateDiamond(key).name, first.name);
  EXPECT_EQ(store_->ListJobs({}, 0, 100, {}).size(), 4u);
  EXPECT_EQ(ReasonThrown([&] {
              CreateDiamond({"CreateJob", "id-1", "other body"});
            }),
            "REQUEST_ID_REUSED");
  EXPECT_NE(CreateDiamond({"CreateJob", "id-2", "body-1"}).name, first.name);
  // A retry must not happen twice for one request.
  const JobRecord import = ClaimOne();
  FailWith(import, ErrorCode::kInternal);
  const RequestKey retry{"RetryJob", "id-3", "b"};
  store_->Retry(first.name, false, retry, kNoLimit);
  FailWith(ClaimOne(), ErrorCode::kInternal);
  EXPECT_EQ(store_->Retry(first.name, false, retry, kNoLimit).state, JobState::kFailed);
}

TEST_P(StoreTest, ConcurrentEqualRequestsCreateOneJob) {
  const auto other = OpenOther();
  const RequestKey key{"CreateJob", "same", "body"};
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("single")};
  std::vector<std::string> names(8);
  std::vector<std::thread> threads;
  for (size_t i = 0; i < names.size(); ++i) {
    threads.emplace_back([&, i] {
      SqlJobStore& store = i % 2 == 0 ? *store_ : *other;
      names[i] = store.CreateGraph(graph, key, kNoLimit).name;
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::string& name : names) EXPECT_EQ(name, names[0]);
  EXPECT_EQ(store_->ListJobs({}, 0, 100, {}).size(), 1u);
}

TEST_P(StoreTest, StateSurvivesReopening) {
  const JobRecord root = CreateDiamond();
  const JobRecord import = ClaimOne();
  store_.reset();
  Open();
  EXPECT_EQ(Child(root, "import").state, JobState::kRunning);
  Succeed(import);  // the worker survived
  EXPECT_EQ(Child(root, "left").state, JobState::kQueued);
  EXPECT_GT(store_->NewestRevision(), 0);
}

using SqliteStoreTest = JobStoreTest;

TEST_F(SqliteStoreTest, ReportsGarbageFile) {
  store_.reset();
  std::filesystem::remove(scratch_.path() / "jobs.db-wal");
  WriteFileAtomic(scratch_.path() / "jobs.db", std::string(4096, 'x'));
  EXPECT_EQ(ReasonThrown([&] { Open(); }), "STORE_CORRUPT");
}

TEST_P(StoreTest, EventsResumeAndCoalesceProgress) {
  const JobRecord job = CreateSingle();
  const std::vector<int64_t> ids = store_->ResolveWatch({job.name});
  const JobRecord running = ClaimOne();
  for (int step = 1; step <= 20; ++step) {
    ProgressRecord progress;
    progress.step = step;
    store_->Heartbeat(LeaseOf(running), progress, {}, kLease);
  }
  const auto events = store_->EventsSince(0, ids, 100);
  ASSERT_EQ(events.size(), 3u) << "QUEUED, RUNNING and only the newest progress";
  EXPECT_EQ(events[0].state, JobState::kQueued);
  EXPECT_EQ(events[1].state, JobState::kRunning);
  EXPECT_EQ(events[2].kind, EventKind::kProgress);
  EXPECT_EQ(store_->GetJob(job.name).revision, events[2].revision);
  Succeed(running);
  const auto later = store_->EventsSince(events[1].revision, ids, 100);
  ASSERT_EQ(later.size(), 1u) << "progress is of no interest once the state has changed";
  EXPECT_EQ(later[0].state, JobState::kSucceeded);
  EXPECT_GT(later[0].revision, events[2].revision);
}

TEST_P(StoreTest, ReportsCompactedRevisions) {
  const JobRecord job = CreateSingle();
  const std::vector<int64_t> ids = store_->ResolveWatch({job.name});
  Succeed(ClaimOne());
  const int64_t newest = store_->NewestRevision();
  store_->Compact(wall_ + 1, wall_ + 1);
  EXPECT_EQ(ReasonThrown([&] { store_->EventsSince(0, ids, 10); }), "REVISION_COMPACTED");
  EXPECT_TRUE(store_->EventsSince(newest, ids, 10).empty());
  EXPECT_EQ(ReasonThrown([&] { store_->EventsSince(newest + 1, ids, 10); }), "REVISION_COMPACTED");
  EXPECT_EQ(store_->NewestRevision(), newest);
}

TEST_P(StoreTest, RequestIdsSurviveClockJump) {
  constexpr int64_t kDay = 24 * 3600 * 1000, kKept = 7 * kDay;
  const RequestKey key{"CreateJob", "id", "body"};
  CreateDiamond(key);
  const auto sweep = [&](int64_t days) {  // once an hour
    for (int64_t hour = 0; hour < days * 24; ++hour) {
      now_ += kDay / 24;
      wall_ += kDay / 24;
      store_->Compact(0, wall_ - kKept);
    }
    return store_->FindRequest(key).has_value();
  };
  EXPECT_TRUE(sweep(2));
  wall_ += 30 * kDay;
  store_->Compact(0, wall_ - kKept);
  EXPECT_TRUE(store_->FindRequest(key)) << "the clock may be set right";
  wall_ -= 30 * kDay;
  EXPECT_TRUE(sweep(4));
  EXPECT_FALSE(sweep(3));
}

TEST_P(StoreTest, DeletesChildrenAndRefusesJobsInUse) {
  const JobRecord root = CreateDiamond();
  EXPECT_EQ(ReasonThrown([&] { store_->Delete(root.name, {}); }), "WRONG_STATE");
  EXPECT_EQ(ReasonThrown([&] { store_->DeleteScene("scenes/test", {}); }), "SCENE_IN_USE");
  for (int i = 0; i < 4; ++i) Succeed(ClaimOne());
  NewGraph reader;
  reader.scene = "scenes/test";
  reader.jobs = {Job("reader")};
  reader.jobs[0].input_jobs = {Child(root, "left").name};
  const JobRecord own = store_->CreateGraph(reader, {}, kNoLimit);
  EXPECT_EQ(own.state, JobState::kQueued);
  EXPECT_EQ(ReasonThrown([&] { store_->Delete(root.name, {}); }), "WRONG_STATE");
  Succeed(ClaimOne());
  const std::string digest = store_->ListChildren(root.name)[1].artifacts.at(0).digest.sha256;
  EXPECT_EQ(store_->ReferencedBlobs().count(digest), 1u);
  store_->Delete(root.name, {"DeleteJob", "d", "b"});
  store_->Delete(root.name, {"DeleteJob", "d", "b"});
  EXPECT_EQ(ReasonThrown([&] { store_->Delete(root.name, {}); }), "JOB_NOT_FOUND");
  EXPECT_EQ(store_->ReferencedBlobs().count(digest), 0u);
  EXPECT_EQ(store_->ListJobs({}, 0, 10, {}).size(), 1u);
  store_->DeleteScene("scenes/test", {});
  EXPECT_EQ(ReasonThrown([&] { store_->GetScene("scenes/test"); }), "SCENE_NOT_FOUND");
}

TEST_P(StoreTest, ListsArePagedNewestFirst) {
  const JobRecord root = CreateDiamond();
  CreateSingle();
  const auto first = store_->ListJobs({}, 0, 3, {});
  ASSERT_EQ(first.size(), 3u);
  const auto rest = store_->ListJobs({}, first.back().id, 3, {});
  ASSERT_EQ(rest.size(), 2u);
  EXPECT_GT(first.back().id, rest.front().id);
  EXPECT_EQ(store_->ListJobs({root.name, ""}, 0, 10, {}).size(), 3u);
  EXPECT_EQ(store_->ListJobs({"", "scenes/test"}, 0, 10, {}).size(), 5u);
  EXPECT_TRUE(store_->ListJobs({"", "scenes/other"}, 0, 10, {}).empty());
}

TEST_P(StoreTest, ListsKeepBudgetWithLongRows) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("a")};
  graph.jobs[0].spec = std::string(5 << 20, 's');
  std::vector<int64_t> ids;
  for (int i = 0; i < 3; ++i) ids.push_back(store_->CreateGraph(graph, {}, kNoLimit).id);
  EXPECT_EQ(store_->ListJobs({}, 0, 10, {6 << 20, INT64_MAX}).size(), 2u);
  const auto without = store_->ListJobs({}, 0, 10, {6 << 20, 1 << 16});
  ASSERT_EQ(without.size(), 3u);
  EXPECT_TRUE(without[0].spec.empty());
  const LoadedJobs loaded = store_->LoadJobs(ids, {1, INT64_MAX});
  EXPECT_EQ(loaded.looked_for, 1u);
  ASSERT_EQ(loaded.jobs.size(), 1u);
  EXPECT_EQ(loaded.jobs[0].spec.size(), size_t{5} << 20);
  EXPECT_EQ(store_->LoadJobs({ids[0] + 1000, ids[1]}, {1, INT64_MAX}).looked_for, 2u);
  for (const JobRecord& job : store_->Snapshot(ids).jobs) EXPECT_TRUE(job.spec.empty());
}

}  // namespace
}  // namespace color3d
