// Scripted scenario of an upload and of jobs that read it, in sequence, joined, cancelled and
// drained. The nth call of the stores fails, before or after its effect, for every n; nevertheless
// all jobs end and each effect is complete and happens once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <map>
#include <optional>
#include <thread>
#include <utility>

#include "core/base/files.h"
#include "core/catalogue/stages.h"
#include "server/planning/job_spec.h"
#include "server/storage/file_blob_store.h"
#include "server/storage/upload_store.h"
#include "server/store/sqlite_db.h"
#include "server/store/sqlite_job_store.h"
#include "server/worker/attempt.h"
#include "tests/support/memory_folder.h"
#include "tests/support/service/failing_stores.h"

namespace color3d {
namespace {
namespace fs = std::filesystem;
using testing::Faults;

constexpr int kSteps = 3;

// Loses the first stored result, like a disk that was cleared.
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

// Runs steps with a checkpoint after each; the result lists each step once.
class SteppingRunner : public StageRunner {
 public:
  StageOutput Run(const StageRun& run,
                  BlobSource&,
                  CheckpointStore& checkpoints,
                  ProgressObserver& progress,
                  const CancellationToken& cancel) override {
    std::string trace = checkpoints.Load().value_or("");
    while (trace.size() < kSteps) {
      if (on_step) on_step(run, cancel);
      cancel.ThrowIfCancelled();
      trace += static_cast<char>('0' + trace.size());
      if (checkpoints.WantsSave()) checkpoints.Save(trace);
      progress.OnProgress(static_cast<int64_t>(trace.size()), kSteps, "stepping");
    }
    for (const auto& [name, file] : run.inputs) trace += " after " + ReadFile(file);
    WriteFileAtomic(run.output_folder / "trace", trace);
    return {{"trace"}, {}};
  }

  std::function<void(const StageRun&, const CancellationToken&)> on_step;
};

bool WaitFor(const std::function<bool()>& condition) {
  for (int i = 0; i < 5000 && !condition(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return condition();
}

// The seed of a job selects its scenario.
constexpr uint64_t kPlain = 1;  // two submissions: one joins the other
constexpr uint64_t kDrained = 2, kCancelled = 3, kBatched = 4;
constexpr char kBatchedGroup[] = "batched";

// Data folder with jobs from submission to end.
class World {
 public:
  World(Faults& faults, Faults& of_heartbeats)
      : paths_(scratch_.path() / "data"),
        store_((PrepareDataFolder(paths_), paths_.Store()), StoreRole::kServer, clocks_),
        failing_store_(paths_.Store(), clocks_, faults),
        heartbeats_(paths_.Store(), clocks_, of_heartbeats),
        failing_blobs_(paths_.Blobs(), faults),
        forgetful_blobs_(paths_.Blobs()),
        uploads_(paths_.Uploads(), failing_blobs_, 1 << 20) {
    timing_.report_pause = timing_.progress = std::chrono::milliseconds(1);
    timing_.heartbeat = std::chrono::milliseconds(6);
    runner_.on_step = [this](const StageRun& run, const CancellationToken& cancel) {
      OnStep(run, cancel);
    };
  }

  SteppingRunner& runner() { return runner_; }

  // Retries like a client until success.
  void UploadPhoto() {
    const std::string photo = "photo";
    const UploadName name{"upload", {Sha256Hex(photo), static_cast<int64_t>(photo.size())}};
    bool is_there = false;
    for (int tries = 0; tries < 3 && !is_there; ++tries) {
      try {
        const int64_t begun = uploads_.CommittedSize(name);
        const auto writer = uploads_.Open(name, begun);
        writer->Append(begun, photo.substr(static_cast<size_t>(begun)));
        writer->Finish();
        is_there = true;
      } catch (const Error&) {  // the next try
      }
    }
    ASSERT_TRUE(is_there);
    SceneRecord scene;
    scene.name = kScene;
    scene.files = {{"a.jpg", name.digest}};
    store_.CreateScene(scene, {}, {});
    store_.ActivateScene(scene.name, CaptureLayout::kPhotos, 1, {});
  }

  // Submits a job alone or with an input job.
  void Submit(uint64_t seed, int priority, bool with_input) {
    NewGraph graph;
    graph.scene = kScene;
    graph.priority = priority;
    v1::JobSpec spec;
    spec.set_scene(kScene);
    spec.set_seed(seed);
    for (const char* kind : {kind::kImportScene, kind::kSelectKeyView}) {
      if (!with_input && !graph.jobs.empty()) break;
      MutableStage(&spec, kind);
      NewJob job;
      job.kind = kind;
      job.spec = spec.SerializeAsString();
      if (seed == kBatched) job.needs.batch_group = kBatchedGroup;
      if (!graph.jobs.empty()) job.inputs = {0};
      graph.jobs.push_back(job);
    }
    roots_.push_back(store_.CreateGraph(graph, {}, 100).name);
  }

  // Runs jobs like a worker loop until all have ended.
  void Work(bool forgetful = false) {
    forgetful_ = forgetful;
    const std::vector<int64_t> ids = store_.ResolveWatch(roots_);
    for (int turn = 0; turn < 60 && !store_.AllFinished(ids); ++turn) {
      store_.ReapExpired();
      Try([&] { failing_store_.UpdateWorker({"worker", 1, "", 0, 0}); });
      if (const auto job = Claim()) {
        const auto other = ClaimConcurrently(*job);
        Attempt(*job);
        if (other) Attempt(*other);
      }
      draining_ = false;
      now_ += 1'000'000;  // leases and pauses pass
    }
    Try([&] { failing_store_.RemoveWorker("worker"); });
  }

  // Final states of jobs and their children.
  std::vector<JobRecord> Jobs() { return store_.LoadJobs(store_.ResolveWatch(roots_), {}).jobs; }

  // Invariants after any failure.
  void CheckWhole() {
    const FileBlobStore blobs(paths_.Blobs(), {0});
    EXPECT_TRUE(store_.AllFinished(store_.ResolveWatch(roots_))) << "a job never ends";
    for (const JobRecord& job : Jobs()) {
      EXPECT_EQ(job.artifacts.empty(), job.state != JobState::kSucceeded) << job.kind;
      for (const ArtifactRecord& artifact : job.artifacts) {
        EXPECT_TRUE(IsIntact(blobs, artifact.digest));
        const std::string expected = job.kind == kind::kImportScene ? "012" : "012 after 012";
        EXPECT_EQ(ReadFile(blobs.Fetch(artifact.digest.sha256)), expected) << job.kind;
      }
      if (job.state == JobState::kFailed) {
        EXPECT_NE(job.error->message, "");
      }
    }
    EXPECT_TRUE(fs::is_empty(paths_.Scratch()));
    EXPECT_TRUE(fs::is_empty(paths_.Uploads()));
    SqliteDatabase db(paths_.Store(), SqliteAccess::kRead);
    SqliteStatement wins(db,
                         "select count(*), count(distinct job_id) from job_attempt where "
                         "outcome='SUCCEEDED'");
    ASSERT_TRUE(wins.Step());
    EXPECT_EQ(wins.Int(0), wins.Int(1)) << "a job succeeded twice";
    SqliteStatement open(db, "select count(*) from job_attempt where end_ms=0");
    ASSERT_TRUE(open.Step());
    EXPECT_EQ(open.Int(0), 0) << "an attempt never ended";
  }

  bool HasJoined() const {
    SqliteDatabase db(paths_.Store(), SqliteAccess::kRead);
    SqliteStatement joined(db, "select 1 from job_attempt where outcome='JOINED'");
    return joined.Step();
  }

 private:
  static constexpr char kScene[] = "scenes/test";

  // The worker's loop logs it and goes on.
  template <class Body>
  static void Try(Body&& body) {
    try {
      body();
    } catch (const Error&) {
    }
  }
  std::optional<JobRecord> Claim() {
    std::optional<JobRecord> job;
    Try([&] { job = failing_store_.Claim("worker", timing_.lease.count()); });
    return job;
  }
  std::optional<JobRecord> ClaimConcurrently(const JobRecord& job) {
    ClaimTerms terms{.worker = "worker", .lease_ms = timing_.lease.count()};
    terms.batch_kind = job.kind;
    terms.batch_group = kBatchedGroup;
    std::optional<JobRecord> other;
    Try([&] { other = failing_store_.Claim(terms); });
    return other;
  }
  void Attempt(const JobRecord& job) {
    BlobStore& blobs = forgetful_ ? static_cast<BlobStore&>(forgetful_blobs_) : failing_blobs_;
    const AttemptContext context{failing_store_,
                                 heartbeats_,
                                 blobs,
                                 runner_,
                                 paths_,
                                 timing_,
                                 std::chrono::milliseconds(0),
                                 1,
                                 "code",
                                 models_,
                                 digests_,
                                 draining_,
                                 [](const JobRecord&) {}};
    RunAttempt(context, job);
  }

  void OnStep(const StageRun& run, const CancellationToken& cancel) {
    const uint64_t seed = run.spec.seed();
    if (seed == kPlain && !std::exchange(met_, true)) {
      if (const auto twin = Claim()) Attempt(*twin);  // of another worker
    } else if (seed == kDrained && !std::exchange(drained_, true)) {
      draining_ = true;
      EXPECT_TRUE(WaitFor([&] { return cancel.IsCancelled(); }));
    } else if (seed == kCancelled) {
      store_.Cancel(run.job_name, {});
      EXPECT_TRUE(WaitFor([&] { return cancel.IsCancelled(); }));
    }
  }

  const ScratchFolder scratch_{MemoryFolder()};
  const DataPaths paths_;
  std::atomic<int64_t> now_{1'000'000};
  const Clocks clocks_{SystemClock(), [this] { return now_.load(); }};
  SqliteJobStore store_;
  testing::FailingStore failing_store_, heartbeats_;
  testing::FailingBlobs failing_blobs_;
  ForgetfulBlobs forgetful_blobs_;
  UploadStore uploads_;
  SteppingRunner runner_;
  const UserModels models_;
  FileDigests digests_;
  LeaseTiming timing_;
  std::atomic<bool> draining_{false};
  bool forgetful_ = false, met_ = false, drained_ = false;
  std::vector<std::string> roots_;
};

struct Life {
  int calls = 0;
  std::string failed_call;
  std::set<std::string> seen;
  std::vector<JobRecord> jobs;
};

Life Live(int target, bool after, ErrorCode code) {
  Faults faults(target, after, code), none(0, false, code);
  World world(faults, none);
  world.UploadPhoto();
  world.Submit(kPlain, 1, /*with_input=*/true);
  world.Submit(kPlain, 1, /*with_input=*/false);
  for (const uint64_t seed : {kDrained, kCancelled, kBatched}) world.Submit(seed, 100, false);
  world.Work();
  world.CheckWhole();
  if (target == 0) {
    EXPECT_TRUE(world.HasJoined());
  }
  return {faults.calls(), faults.failed(), faults.seen(), world.Jobs()};
}

JobState EndOf(const JobRecord& job) {
  const bool is_cancelled = ParseSpec(job.spec, job.name).seed() == kCancelled;
  return is_cancelled ? JobState::kCancelled : JobState::kSucceeded;
}

TEST(FaultInjectionTest, ScenarioMakesEveryCall) {
  EXPECT_THAT(Live(0, false, ErrorCode::kUnavailable).seen,
              ::testing::IsSupersetOf({"Adopt",
                                       "Claim",
                                       "ClaimForBatch",
                                       "Fail",
                                       "Fetch",
                                       "FindStage",
                                       "GetInputs",
                                       "GetScene",
                                       "IsReferenced",
                                       "JoinEqual",
                                       "ListChildren",
                                       "Publish",
                                       "PutBytes",
                                       "PutFile",
                                       "Release",
                                       "Look",
                                       "RemoveIfUntouched",
                                       "RemoveWorker",
                                       "RequireSpace",
                                       "Reserve",
                                       "SetCheckpoint",
                                       "Touch",
                                       "UpdateWorker"}));
}

TEST(FaultInjectionTest, TransientFailureFailsNoJob) {
  const Life undisturbed = Live(0, false, ErrorCode::kUnavailable);
  for (const JobRecord& job : undisturbed.jobs) {
    EXPECT_EQ(job.state, EndOf(job)) << job.kind;
    EXPECT_EQ(job.attempt, 1) << "a drain or a join has cost an attempt";
  }
  ASSERT_EQ(undisturbed.jobs.size(), 6u);
  for (const bool after : {false, true}) {
    for (int n = 1; n <= undisturbed.calls; ++n) {
      SCOPED_TRACE((after ? "after call " : "before call ") + std::to_string(n));
      const Life life = Live(n, after, ErrorCode::kUnavailable);
      EXPECT_NE(life.failed_call, "");
      for (const JobRecord& job : life.jobs) {
        EXPECT_EQ(job.state, EndOf(job)) << life.failed_call << ", " << job.kind;
        EXPECT_LE(job.attempt, 2) << life.failed_call;
      }
    }
  }
}

TEST(FaultInjectionTest, DoesNotPublishMissingResult) {
  Faults none(0, false, ErrorCode::kUnavailable);
  World world(none, none);
  world.UploadPhoto();
  world.Submit(kBatched, 1, /*with_input=*/true);
  world.Work(/*forgetful=*/true);
  world.CheckWhole();
  for (const JobRecord& job : world.Jobs()) {
    EXPECT_EQ(job.state, JobState::kSucceeded) << job.kind;
    EXPECT_EQ(job.attempt, job.kind == kind::kImportScene ? 2 : 1);
  }
}

TEST(FaultInjectionTest, PermanentFailureEndsJobWithReason) {
  const int calls = Live(0, false, ErrorCode::kInternal).calls;
  for (const bool after : {false, true}) {
    for (int n = 1; n <= calls; ++n) {
      SCOPED_TRACE((after ? "after call " : "before call ") + std::to_string(n));
      EXPECT_NE(Live(n, after, ErrorCode::kInternal).failed_call, "");
    }
  }
}

// Each step lasts for two heartbeats or checks of the heartbeat thread.
TEST(FaultInjectionTest, FailedHeartbeatsCostAtMostOneAttempt) {
  std::set<std::string> failed;
  for (const ErrorCode code :
       {ErrorCode::kUnavailable, ErrorCode::kInternal, ErrorCode::kAborted}) {
    for (int n = 1; n <= 6; ++n) {
      for (const bool after : {false, true}) {
        Faults none(0, false, code), faults(n, after, code);
        World world(none, faults);
        world.runner().on_step = [&](const StageRun&, const CancellationToken& cancel) {
          const int before = faults.calls();
          EXPECT_TRUE(
              WaitFor([&] { return cancel.IsCancelled() || faults.calls() >= before + 2; }));
        };
        world.UploadPhoto();
        world.Submit(kBatched, 1, /*with_input=*/false);
        world.Work();
        world.CheckWhole();
        failed.insert(faults.failed());
        for (const JobRecord& job : world.Jobs()) {
          EXPECT_EQ(job.state, JobState::kSucceeded);
          EXPECT_EQ(job.attempt, code == ErrorCode::kAborted ? 2 : 1) << faults.failed();
        }
      }
    }
  }
  EXPECT_THAT(failed, ::testing::ElementsAre("Heartbeat", "Peek"));
}

}  // namespace
}  // namespace color3d
