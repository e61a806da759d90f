// A scripted life of two jobs in which the nth call of the stores fails, before or after it has had
// its effect, for every n: whatever it is, every job ends, and each effect is there once and whole.
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <optional>
#include <utility>

#include "core/base/files.h"
#include "server/planning/job_spec.h"
#include "server/service_error.h"
#include "server/storage/file_blob_store.h"
#include "server/store/sqlite_db.h"
#include "server/store/sqlite_job_store.h"
#include "server/worker/attempt.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;

constexpr int kSteps = 3;

// Counts the calls of both stores, and makes one of them fail.
class Faults {
 public:
  Faults(int target, bool after, ErrorCode code) : target_(target), after_(after), code_(code) {}

  template <class Body>
  auto Around(const char* call, Body&& body) {
    const bool hit = ++calls_ == target_;
    if (hit) call_ = call;
    if (hit && !after_) Throw();
    if constexpr (std::is_void_v<decltype(body())>) {
      body();
      if (hit) Throw();
    } else {
      auto result = body();
      if (hit) Throw();
      return result;
    }
  }
  int calls() const { return calls_; }
  const std::string& call() const { return call_; }

 private:
  [[noreturn]] void Throw() const {
    throw ServiceError(code_, "INJECTED", "the disk did not answer");
  }

  const int target_;
  const bool after_;
  const ErrorCode code_;
  int calls_ = 0;
  std::string call_;
};

class FailingStore : public SqliteJobStore {
 public:
  FailingStore(const fs::path& file, const Clocks& clocks, Faults& faults)
      : SqliteJobStore(file, StoreRole::kWorker, clocks), faults_(faults) {}

  SceneRecord GetScene(const std::string& name) override {
    return faults_.Around("GetScene", [&] { return SqliteJobStore::GetScene(name); });
  }
  std::vector<JobRecord> ListChildren(const std::string& name) override {
    return faults_.Around("ListChildren", [&] { return SqliteJobStore::ListChildren(name); });
  }
  std::optional<JobRecord> Claim(const std::string& worker, int64_t lease_ms) override {
    return faults_.Around("Claim", [&] { return SqliteJobStore::Claim(worker, lease_ms); });
  }
  std::vector<JobRecord> GetInputs(int64_t job_id) override {
    return faults_.Around("GetInputs", [&] { return SqliteJobStore::GetInputs(job_id); });
  }
  std::optional<FileDigest> SetCheckpoint(const Lease& lease, const FileDigest& blob) override {
    return faults_.Around("SetCheckpoint",
                          [&] { return SqliteJobStore::SetCheckpoint(lease, blob); });
  }
  void Publish(const Lease& lease, const Publication& publication) override {
    faults_.Around("Publish", [&] { SqliteJobStore::Publish(lease, publication); });
  }
  void Fail(const Lease& lease, const JobError& error, const JobUsage& usage) override {
    faults_.Around("Fail", [&] { SqliteJobStore::Fail(lease, error, usage); });
  }
  std::optional<JobRecord> FindStage(const std::string& stage_key) override {
    return faults_.Around("FindStage", [&] { return SqliteJobStore::FindStage(stage_key); });
  }
  bool IsReferenced(const std::string& sha256) override {
    return faults_.Around("IsReferenced", [&] { return SqliteJobStore::IsReferenced(sha256); });
  }

 private:
  Faults& faults_;
};

class FailingBlobs : public FileBlobStore {
 public:
  FailingBlobs(const fs::path& folder, Faults& faults)
      : FileBlobStore(folder, {0}), faults_(faults) {}

  bool Touch(const FileDigest& digest) const override {
    return faults_.Around("Touch", [&] { return FileBlobStore::Touch(digest); });
  }
  fs::path Fetch(const std::string& sha256) const override {
    return faults_.Around("Fetch", [&] { return FileBlobStore::Fetch(sha256); });
  }
  FileDigest PutBytes(std::string_view bytes) override {
    return faults_.Around("PutBytes", [&] { return FileBlobStore::PutBytes(bytes); });
  }
  FileDigest PutFile(const fs::path& file) override {
    return faults_.Around("PutFile", [&] { return FileBlobStore::PutFile(file); });
  }
  void Remove(const std::string& sha256) override {
    faults_.Around("Remove", [&] { FileBlobStore::Remove(sha256); });
  }
  void RequireSpace(int64_t bytes) const override {
    faults_.Around("RequireSpace", [&] { FileBlobStore::RequireSpace(bytes); });
  }

 private:
  Faults& faults_;
};

// The first result is gone as soon as it was put: somebody cleared the disk.
class ForgetfulBlobs : public FileBlobStore {
 public:
  explicit ForgetfulBlobs(const fs::path& folder) : FileBlobStore(folder, {0}) {}
  FileDigest PutFile(const fs::path& file) override {
    const FileDigest digest = FileBlobStore::PutFile(file);
    if (!std::exchange(forgot_, true)) FileBlobStore::Remove(digest.sha256);
    return digest;
  }

 private:
  bool forgot_ = false;
};

// Steps with a checkpoint after each; the result tells every step once.
class SteppingRunner : public StageRunner {
 public:
  StageOutput Run(const StageRun& run,
                  BlobSource&,
                  CheckpointStore& checkpoints,
                  ProgressObserver& progress,
                  const CancellationToken& cancel) override {
    std::string trace = checkpoints.Load().value_or("");
    while (trace.size() < kSteps) {
      cancel.ThrowIfCancelled();
      trace += static_cast<char>('0' + trace.size());
      if (checkpoints.WantsSave()) checkpoints.Save(trace);
      progress.OnProgress(static_cast<int64_t>(trace.size()), kSteps, "stepping");
    }
    for (const auto& [name, file] : run.inputs) trace += " after " + ReadFile(file);
    WriteFileAtomic(run.output_folder / "trace", trace);
    return {{"trace"}, {}};
  }
};

class FaultInjectionTest : public testing::Test {
 protected:
  struct Life {
    int calls = 0;
    std::string failed_call;
    std::vector<JobRecord> jobs;
  };

  // From submission until all jobs have ended, in a folder of its own. `forgetful`: with blobs that
  // lose one.
  Life Live(int target, bool after, ErrorCode code, bool forgetful = false) {
    const ScratchFolder scratch;
    const DataPaths paths(scratch.path() / "data");
    PrepareDataFolder(paths);
    const Clocks clocks{SystemClock(), [this] { return now_.load(); }};
    SqliteJobStore store(paths.Store(), StoreRole::kServer, clocks);
    FileBlobStore blobs(paths.Blobs(), {0});
    SceneRecord scene;
    scene.name = "scenes/test";
    scene.files = {{"a.jpg", blobs.PutBytes("photo")}};
    store.CreateScene(scene, {});
    store.ActivateScene(scene.name, StoredLayout::kPhotos, 1, {});
    const JobRecord root = Submit(store);

    Faults faults(target, after, code);
    FailingStore failing_store(paths.Store(), clocks, faults);
    FailingBlobs failing_blobs(paths.Blobs(), faults);
    ForgetfulBlobs forgetful_blobs(paths.Blobs());
    SqliteJobStore heartbeats(paths.Store(), StoreRole::kWorker, clocks);
    SteppingRunner runner;
    const UserModels models;
    FileDigests digests;
    const std::atomic<bool> draining{false};
    LeaseTiming timing;
    timing.report_pause = std::chrono::milliseconds(1);
    const AttemptContext context{
        failing_store,
        heartbeats,
        forgetful ? static_cast<BlobStore&>(forgetful_blobs) : failing_blobs,
        runner,
        paths,
        timing,
        std::chrono::milliseconds(0),
        1,
        "code",
        models,
        digests,
        draining,
        [](const JobRecord&) {}};
    const std::vector<int64_t> ids = store.ResolveWatch({root.name});
    for (int turn = 0; turn < 30 && !store.AllFinished(ids); ++turn) {
      store.ReapExpired();
      std::optional<JobRecord> job;
      try {
        job = failing_store.Claim("worker", timing.lease.count());
      } catch (const Error&) {  // the worker loop logs it and goes on
      }
      if (job) RunAttempt(context, *job);
      now_ += 1'000'000;  // leases and pauses pass
    }
    CheckWhole(store, blobs, paths, ids);
    Life life{faults.calls(), faults.call(), store.ListChildren(root.name)};
    life.jobs.push_back(store.GetJob(root.name));
    return life;
  }

  static JobRecord Submit(JobStore& store) {
    NewGraph graph;
    graph.scene = "scenes/test";
    v1::JobSpec spec;
    spec.set_scene(graph.scene);
    spec.mutable_import_scene();
    NewJob first;
    first.kind = "import_scene";
    first.spec = spec.SerializeAsString();
    spec.mutable_select_key_view();
    NewJob second;
    second.kind = "select_key_view";
    second.spec = spec.SerializeAsString();
    second.inputs = {0};
    graph.jobs = {first, second};
    return store.CreateGraph(graph, {}, 100);
  }

  // What must hold whatever has failed.
  static void CheckWhole(JobStore& store,
                         const BlobStore& blobs,
                         const DataPaths& paths,
                         const std::vector<int64_t>& ids) {
    EXPECT_TRUE(store.AllFinished(ids)) << "a job never ends";
    for (const JobRecord& job : store.Snapshot(ids).jobs) {
      EXPECT_EQ(job.artifacts.empty(), job.state != JobState::kSucceeded) << job.kind;
      for (const ArtifactRecord& artifact : job.artifacts) {
        EXPECT_TRUE(IsIntact(blobs, artifact.digest));
        const std::string expected = job.kind == "import_scene" ? "012" : "012 after 012";
        EXPECT_EQ(ReadFile(blobs.Fetch(artifact.digest.sha256)), expected) << job.kind;
      }
      if (job.state == JobState::kFailed) {
        EXPECT_NE(job.error->message, "");
      }
    }
    EXPECT_TRUE(fs::is_empty(paths.Scratch()));
    SqliteDatabase db(paths.Store(), SqliteAccess::kRead);
    SqliteStatement wins(db.handle(),
                         "select count(*), count(distinct job_id) from job_attempt where "
                         "outcome='SUCCEEDED'");
    ASSERT_TRUE(wins.Step());
    EXPECT_EQ(wins.Int(0), wins.Int(1)) << "a job succeeded twice";
    SqliteStatement open(db.handle(), "select count(*) from job_attempt where end_ms=0");
    ASSERT_TRUE(open.Step());
    EXPECT_EQ(open.Int(0), 0) << "an attempt never ended";
  }

  std::atomic<int64_t> now_{1'000'000};
};

TEST_F(FaultInjectionTest, WhateverFailsOnceInPassingCostsNoJob) {
  const Life undisturbed = Live(0, false, ErrorCode::kUnavailable);
  for (const JobRecord& job : undisturbed.jobs) EXPECT_EQ(job.state, JobState::kSucceeded);
  ASSERT_GT(undisturbed.calls, 30);
  for (const bool after : {false, true}) {
    for (int n = 1; n <= undisturbed.calls; ++n) {
      SCOPED_TRACE((after ? "after call " : "before call ") + std::to_string(n));
      const Life life = Live(n, after, ErrorCode::kUnavailable);
      EXPECT_NE(life.failed_call, "");
      for (const JobRecord& job : life.jobs) {
        EXPECT_EQ(job.state, JobState::kSucceeded) << life.failed_call << ", " << job.kind;
        EXPECT_LE(job.attempt, 2) << life.failed_call;
      }
    }
  }
}

TEST_F(FaultInjectionTest, NoResultIsPublishedThatIsGone) {
  const Life life = Live(0, false, ErrorCode::kUnavailable, /*forgetful=*/true);
  for (const JobRecord& job : life.jobs) EXPECT_EQ(job.state, JobState::kSucceeded) << job.kind;
  EXPECT_EQ(life.jobs.front().attempt, 2);
}

TEST_F(FaultInjectionTest, WhatFailsForGoodEndsTheJobWithItsReason) {
  const int calls = Live(0, false, ErrorCode::kInternal).calls;
  for (const bool after : {false, true}) {
    for (int n = 1; n <= calls; ++n) {
      SCOPED_TRACE((after ? "after call " : "before call ") + std::to_string(n));
      EXPECT_NE(Live(n, after, ErrorCode::kInternal).failed_call, "");
    }
  }
}

}  // namespace
}  // namespace color3d
