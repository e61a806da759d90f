#include <gtest/gtest.h>

#include <atomic>
#include <mutex>
#include <set>
#include <thread>

#include "server/store/sqlite_db.h"
#include "tests/support/job_store_fixture.h"

namespace color3d {
namespace {
using JobRecordsTest = JobStoreTest;

TEST_F(JobRecordsTest, RequestIdMakesCallsIdempotent) {
  const RequestKey key{"CreateJob", "id-1", "body-1"};
  const JobRecord first = CreateDiamond(key);
  EXPECT_EQ(CreateDiamond(key).name, first.name);
  EXPECT_EQ(store_->ListJobs({}, 0, 100).size(), 4u);
  EXPECT_EQ(ReasonThrown([&] {
              CreateDiamond({"CreateJob", "id-1", "other body"});
            }),
            "REQUEST_ID_REUSED");
  EXPECT_NE(CreateDiamond({"CreateJob", "id-2", "body-1"}).name, first.name);
  // A retry must not happen twice for one request.
  const JobRecord import = ClaimOne();
  FailWith(import, ErrorCode::kInternal);
  const RequestKey retry{"RetryJob", "id-3", "b"};
  store_->Retry(first.name, false, retry);
  FailWith(ClaimOne(), ErrorCode::kInternal);
  EXPECT_EQ(store_->Retry(first.name, false, retry).state, JobState::kFailed);
}

TEST_F(JobRecordsTest, EqualRequestsAtOnceMakeOneJob) {
  SqliteJobStore other(scratch_.path() / "jobs.db", [this] { return now_.load(); });
  const RequestKey key{"CreateJob", "same", "body"};
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("single")};
  std::vector<std::string> names(8);
  std::vector<std::thread> threads;
  for (size_t i = 0; i < names.size(); ++i) {
    threads.emplace_back([&, i] {
      JobStore& store = i % 2 == 0 ? static_cast<JobStore&>(*store_) : other;
      names[i] = store.CreateGraph(graph, key, kNoLimit).name;
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::string& name : names) EXPECT_EQ(name, names[0]);
  EXPECT_EQ(store_->ListJobs({}, 0, 100).size(), 1u);
}

TEST_F(JobRecordsTest, StateSurvivesReopening) {
  const JobRecord root = CreateDiamond();
  const JobRecord import = ClaimOne();
  store_.reset();
  Open();
  EXPECT_EQ(Child(root, "import").state, JobState::kRunning);
  Succeed(import);  // the worker lived on
  EXPECT_EQ(Child(root, "left").state, JobState::kQueued);
  EXPECT_GT(store_->NewestRevision(), 0);
}

TEST_F(JobRecordsTest, NewerSchemaIsRefused) {
  store_.reset();
  SqliteDatabase(scratch_.path() / "jobs.db").Exec("update schema_version set version=99");
  EXPECT_EQ(ReasonThrown([&] { Open(); }), "STORE_VERSION");
}

// A data directory of version 1 goes on with its scenes.
TEST_F(JobRecordsTest, StoreOfVersion1IsBroughtUpToDate) {
  store_.reset();
  {
    SqliteDatabase old(scratch_.path() / "jobs.db");
    old.Exec("alter table scene drop column key_color_job");
    old.Exec("update schema_version set version=1");
  }
  Open();
  EXPECT_EQ(store_->GetScene("scenes/test").key_color_job, "");
  store_.reset();
  Open();  // and is read as the new version from then on
  EXPECT_EQ(store_->ListScenes(0, 10).size(), 1u);
}

TEST_F(JobRecordsTest, OnlyAColoredKeyViewOfTheSceneIsAccepted) {
  SceneRecord other;
  other.name = "scenes/other";
  store_->CreateScene(other, {});
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("colorize_key_view")};
  const std::string job = store_->CreateGraph(graph, {}, kNoLimit).name;
  const auto accept = [&](const std::string& scene, const std::string& name) {
    return store_->AcceptKeyColor(scene, name, {}).key_color_job;
  };
  EXPECT_EQ(ReasonThrown([&] { accept("scenes/test", job); }), "WRONG_STATE");
  Succeed(ClaimOne());
  EXPECT_EQ(accept("scenes/test", job), job);
  EXPECT_EQ(store_->GetScene("scenes/test").key_color_job, job);
  EXPECT_THROW(accept("scenes/other", job), Error);
  EXPECT_THROW(accept("scenes/test", CreateSingle().name), Error);
  EXPECT_EQ(ReasonThrown([&] { accept("scenes/test", "jobs/0000"); }), "JOB_NOT_FOUND");
  EXPECT_EQ(ReasonThrown([&] { accept("scenes/none", job); }), "SCENE_NOT_FOUND");
  EXPECT_EQ(accept("scenes/test", ""), "");
  accept("scenes/test", job);
  store_->Delete(job, {});
  EXPECT_EQ(store_->GetScene("scenes/test").key_color_job, "") << "a job that is gone";
}

TEST_F(JobRecordsTest, GarbageFileIsReportedNotCrashed) {
  store_.reset();
  std::filesystem::remove(scratch_.path() / "jobs.db-wal");
  WriteFileAtomic(scratch_.path() / "jobs.db", std::string(4096, 'x'));
  EXPECT_EQ(ReasonThrown([&] { Open(); }), "STORE_CORRUPT");
}

TEST_F(JobRecordsTest, TwoStoresNeverClaimTheSameJob) {
  constexpr int kJobs = 60;
  for (int i = 0; i < kJobs; ++i) CreateSingle();
  std::atomic<int> claims{0};
  std::mutex mutex;
  std::set<std::string> names;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      SqliteJobStore own(scratch_.path() / "jobs.db", [this] { return now_.load(); });
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

TEST_F(JobRecordsTest, EventsResumeAndCoalesceProgress) {
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

TEST_F(JobRecordsTest, CompactedRevisionsAreReported) {
  const JobRecord job = CreateSingle();
  const std::vector<int64_t> ids = store_->ResolveWatch({job.name});
  Succeed(ClaimOne());
  const int64_t newest = store_->NewestRevision();
  store_->Compact(now_ + 1, now_ + 1);
  EXPECT_EQ(ReasonThrown([&] { store_->EventsSince(0, ids, 10); }), "REVISION_COMPACTED");
  EXPECT_TRUE(store_->EventsSince(newest, ids, 10).empty());
  EXPECT_EQ(ReasonThrown([&] { store_->EventsSince(newest + 1, ids, 10); }), "REVISION_COMPACTED");
  EXPECT_EQ(store_->NewestRevision(), newest);
}

TEST_F(JobRecordsTest, DeleteTakesChildrenAndRefusesWhatIsInUse) {
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
  EXPECT_EQ(store_->ListJobs({}, 0, 10).size(), 1u);
  store_->DeleteScene("scenes/test", {});
  EXPECT_EQ(ReasonThrown([&] { store_->GetScene("scenes/test"); }), "SCENE_NOT_FOUND");
}

TEST_F(JobRecordsTest, ListsArePagedNewestFirst) {
  const JobRecord root = CreateDiamond();
  CreateSingle();
  const auto first = store_->ListJobs({}, 0, 3);
  ASSERT_EQ(first.size(), 3u);
  const auto rest = store_->ListJobs({}, first.back().id, 3);
  ASSERT_EQ(rest.size(), 2u);
  EXPECT_GT(first.back().id, rest.front().id);
  EXPECT_EQ(store_->ListJobs({root.name, ""}, 0, 10).size(), 3u);
  EXPECT_EQ(store_->ListJobs({"", "scenes/test"}, 0, 10).size(), 5u);
  EXPECT_TRUE(store_->ListJobs({"", "scenes/other"}, 0, 10).empty());
}

TEST_F(JobRecordsTest, StageCacheFindsSucceededJobsByKey) {
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

TEST_F(JobRecordsTest, DeadWorkersLoseTheirLeasesAtOnce) {
  const JobRecord job = CreateSingle();
  ClaimOne("worker-1-77");
  store_->UpdateWorker({"worker-1-77", 77, job.name, 5, 0});
  ASSERT_EQ(store_->ListWorkers().size(), 1u);
  EXPECT_TRUE(store_->ExpireLeasesOf("worker-2-78").empty());
  EXPECT_EQ(store_->ExpireLeasesOf("worker-1-77"), std::vector<std::string>{job.name});
  EXPECT_EQ(store_->ReapExpired(), 1);
  EXPECT_EQ(StateOf(job.name), JobState::kQueued);
}

TEST_F(JobRecordsTest, ColorizersAreListedOncePerFile) {
  NewGraph graph;
  graph.scene = "scenes/test";
  graph.jobs = {Job("personalize")};
  for (int i = 0; i < 2; ++i) {  // the second is a cached run with the same file
    store_->CreateGraph(graph, {}, kNoLimit);
    Succeed(ClaimOne(), "colorizer.c3c");
  }
  const auto colorizers = store_->ListColorizers("", 0, 10);
  ASSERT_EQ(colorizers.size(), 1u);
  EXPECT_EQ(store_->GetColorizer(colorizers[0].digest.sha256).job, colorizers[0].job);
  EXPECT_TRUE(store_->ListColorizers("scenes/other", 0, 10).empty());
  EXPECT_EQ(ReasonThrown([&] { store_->GetColorizer(Sha256Hex("no")); }), "COLORIZER_NOT_FOUND");
}

}  // namespace
}  // namespace color3d
