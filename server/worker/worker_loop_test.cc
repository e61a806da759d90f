// The worker loop with scripted stages in this process: concurrent jobs and their independent ends.
#include "server/worker/worker_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <map>
#include <mutex>
#include <thread>

#include "color3d/v1/job.pb.h"
#include "core/base/files.h"
#include "core/catalogue/artifacts.h"
#include "core/catalogue/stages.h"
#include "core/colorizer/scene_batch.h"
#include "server/ops/socket_folder.h"
#include "server/planning/spec_check.h"
#include "server/rpc/rpc_server.h"
#include "server/storage/data_folder.h"
#include "server/storage/file_blob_store.h"
#include "server/store/sqlite_job_store.h"

namespace color3d {
namespace {

constexpr uint64_t kPoison = 666;

// Attempts wait for each other, so that jobs that may run together do.
class MeetingRunner : public StageRunner {
 public:
  StageOutput Run(const StageRun& run,
                  BlobSource&,
                  CheckpointStore& checkpoints,
                  ProgressObserver& progress,
                  const CancellationToken& cancel) override {
    std::unique_lock lock(mutex_);
    ++running_;
    most_ = std::max(most_, running_);
    for (const auto& [name, file] : run.inputs) inputs_[run.job_name].push_back(name);
    met_.notify_all();
    met_.wait_for(lock, std::chrono::seconds(3), [&] { return running_ >= wanted; });
    lock.unlock();
    if (run.spec.seed() == kPoison) {
      lock.lock();
      --running_;
      throw InvalidArgument("poisoned");
    }
    checkpoints.Save("half way of " + run.job_name);
    progress.OnProgress(1, 1, "done");
    cancel.ThrowIfCancelled();
    WriteFileAtomic(run.output_folder / artifact::kColorizer, "of " + run.job_name);
    lock.lock();
    --running_;
    return {{artifact::kColorizer}, {}};
  }

  int wanted = 3;
  int most() const { return most_; }
  std::vector<std::string> InputsOf(const JobRecord& job) const { return inputs_.at(job.name); }

 private:
  std::mutex mutex_;
  std::condition_variable met_;
  int running_ = 0;
  int most_ = 0;
  std::map<std::string, std::vector<std::string>> inputs_;  // names, sorted
};

// Attempts start together and take turns in a batch with one slot, until project "b" has had 100
// turns.
class TurnsRunner : public StageRunner {
 public:
  explicit TurnsRunner(int attempts) : attempts_(attempts) {}
  StageOutput Run(const StageRun& run,
                  BlobSource&,
                  CheckpointStore&,
                  ProgressObserver&,
                  const CancellationToken& cancel) override {
    if (KindOf(run.spec) == kind::kPersonalize) TakeTurns(run.project, cancel);
    WriteFileAtomic(run.output_folder / artifact::kColorizer, run.job_name);
    return {{artifact::kColorizer}, {}};
  }
  int turns(const std::string& project) { return turns_[project]; }

 private:
  void TakeTurns(const std::string& project, const CancellationToken& cancel) {
    SceneBatch::Membership membership(batch_, project);
    ++began_;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (began_ < attempts_ && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    while (!enough_ && std::chrono::steady_clock::now() < end) {
      const SceneBatch::Turn turn(membership, cancel);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      ++turns_[project];  // one slot: no concurrent thread
      if (turns_["b"] >= 100) enough_ = true;
    }
  }

  const int attempts_;
  SceneBatch batch_{1};
  std::atomic<int> began_{0};
  std::atomic<bool> enough_{false};
  std::map<std::string, int> turns_;
};

class WorkerLoopTest : public testing::Test {
 protected:
  WorkerLoopTest() : store_(StoreIn(folder_.path()), StoreRole::kServer, SystemClocks()) {
    RpcServerOptions server;
    server.listen = "127.0.0.1:0";
    server.worker_socket = sockets_.Address(kWorkerSocket);
    server_ = std::make_unique<RpcServer>(server, store_, blobs_, uploads_, SystemClock());
    SceneRecord scene;
    scene.name = "scenes/test";
    store_.CreateScene(scene, {}, {});
    store_.ActivateScene(scene.name, CaptureLayout::kPhotos, 1, {});
    options_.data_folder = folder_.path();
    options_.code_version = "test";
    options_.poll = std::chrono::milliseconds(20);
    options_.reserve_mib = 0;
    options_.recycle_memory_bytes = int64_t{1} << 40;
  }

  static std::filesystem::path StoreIn(const std::filesystem::path& folder) {
    PrepareDataFolder(DataPaths(folder));
    return DataPaths(folder).Store();
  }

  // A graph of personalize jobs with these seeds (different work) and encoders.
  JobRecord Submit(const std::vector<uint64_t>& seeds,
                   const std::string& encoder = "",
                   const std::string& project = "") {
    NewGraph graph;
    graph.project = project;
    graph.scene = "scenes/test";
    NewJob root;
    root.kind = kind::kPersonalizeScenes;
    v1::JobSpec spec;
    spec.mutable_personalize_scenes();
    root.spec = spec.SerializeAsString();
    for (uint64_t seed : seeds) {
      spec.set_seed(seed);
      spec.mutable_personalize()->set_encoder(encoder);
      NewJob job;
      job.kind = kind::kPersonalize;
      job.spec = spec.SerializeAsString();
      job.needs.batch_group = encoder;
      if (!encoder.empty()) job.needs.models = {"model " + encoder};
      root.inputs.push_back(static_cast<int>(graph.jobs.size()));
      graph.jobs.push_back(job);
    }
    graph.jobs.push_back(root);
    return store_.CreateGraph(graph, {}, 1000);
  }

  // Runs a worker until the jobs of these graphs have ended.
  void Work(const std::vector<JobRecord>& roots) { Work(roots, runner_); }
  void Work(const std::vector<JobRecord>& roots, StageRunner& runner) {
    std::atomic<bool> draining{false};
    std::thread worker([&] { RunWorker(options_, runner, draining); });
    std::vector<std::string> names;
    for (const JobRecord& root : roots) names.push_back(root.name);
    const auto ids = store_.ResolveWatch(names);
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!store_.AllFinished(ids) && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    draining = true;
    worker.join();
    EXPECT_TRUE(store_.AllFinished(ids));
  }

  ScratchFolder folder_;
  SqliteJobStore store_;
  const SocketFolder sockets_{DataPaths(folder_.path()).Sockets()};
  FileBlobStore blobs_{DataPaths(folder_.path()).Blobs(), {0}};
  UploadStore uploads_{DataPaths(folder_.path()).Uploads(), blobs_, 1 << 20};
  std::unique_ptr<RpcServer> server_;
  WorkerOptions options_;
  MeetingRunner runner_;
};

TEST_F(WorkerLoopTest, ScenesRunTogetherAndPoisonedOneFailsAlone) {
  const JobRecord root = Submit({1, kPoison, 2});
  Work({root});
  EXPECT_EQ(runner_.most(), 3);
  int succeeded = 0;
  for (const JobRecord& job : store_.ListChildren(root.name)) {
    if (job.state == JobState::kFailed) {
      EXPECT_EQ(job.error->message, "poisoned");
      continue;
    }
    ++succeeded;
    EXPECT_EQ(job.state, JobState::kSucceeded);
    ASSERT_EQ(job.artifacts.size(), 1u);
    EXPECT_EQ(job.artifacts[0].digest.sha256, Sha256Hex("of " + job.name)) << "another's result";
    EXPECT_GT(job.usage.peak_memory_bytes, 0);
  }
  EXPECT_EQ(succeeded, 2);
}

TEST_F(WorkerLoopTest, AdditionalKeyViewsHaveNumberedFolders) {
  runner_.wanted = 1;
  NewGraph graph;
  graph.scene = "scenes/test";
  v1::JobSpec spec;
  for (const char* view : {"", "b", "a"}) {
    spec.mutable_colorize_key_view()->set_view(view);
    NewJob job;
    job.kind = kind::kColorizeKeyView;
    job.spec = spec.SerializeAsString();
    graph.jobs.push_back(job);
  }
  spec.mutable_carry_color();
  NewJob carry;
  carry.kind = kind::kCarryColor;
  carry.spec = spec.SerializeAsString();
  carry.inputs = {0, 1, 2};
  graph.jobs.push_back(carry);
  const JobRecord root = store_.CreateGraph(graph, {}, 1000);
  Work({root});
  const std::string name = artifact::kColorizer;  // the result of every job here
  EXPECT_EQ(runner_.InputsOf(root),
            (std::vector<std::string>{name, "key_views/1/" + name, "key_views/2/" + name}));
}

TEST_F(WorkerLoopTest, LimitsConcurrentScenes) {
  options_.batch_scenes = 2;
  runner_.wanted = 2;
  std::vector<uint64_t> seeds;
  for (uint64_t i = 1; i <= 20; ++i) seeds.push_back(i);
  const JobRecord root = Submit(seeds);
  Work({root});
  EXPECT_EQ(runner_.most(), 2);
  EXPECT_EQ(store_.GetJob(root.name).state, JobState::kSucceeded);
}

// Ten jobs of one project and one of another: each project gets half of the turns.
TEST_F(WorkerLoopTest, ProjectsShareTheBatchEqually) {
  options_.batch_scenes = 11;
  TurnsRunner runner(11);
  std::vector<JobRecord> roots;
  for (uint64_t i = 1; i <= 10; ++i) roots.push_back(Submit({i}, "", "a"));
  roots.push_back(Submit({11}, "", "b"));
  Work(roots, runner);
  EXPECT_GE(runner.turns("b"), 100);
  EXPECT_GT(runner.turns("a"), 60);
  EXPECT_LT(runner.turns("a"), 160);
}

TEST_F(WorkerLoopTest, RunsOneAtATimeWithLittleMemory) {
  options_.recycle_memory_bytes = 1;
  runner_.wanted = 1;
  const JobRecord root = Submit({1, 2});
  std::atomic<bool> draining{false};
  // The process would be recycled after each job: twice here, and once for the parent.
  for (int i = 0; i < 3; ++i) RunWorker(options_, runner_, draining);
  EXPECT_EQ(runner_.most(), 1);
  EXPECT_EQ(store_.GetJob(root.name).state, JobState::kSucceeded);
}

// A worker of another machine has some weights and model servers only: the others' jobs wait.
TEST_F(WorkerLoopTest, WorkerElsewhereTakesJobsOfItsModels) {
  const ScratchFolder own;
  runner_.wanted = 1;
  options_.server.address = server_->address();
  options_.data_folder = own.path();
  options_.models.files["mine"] = own.path() / "weights";
  WriteFileAtomic(own.path() / "weights", "weights");
  const JobRecord theirs = Submit({1}, "theirs"), ours = Submit({2}, "mine");
  std::filesystem::create_directories(own.path() / "scratch");
  Work({ours});
  EXPECT_EQ(store_.GetJob(ours.name).state, JobState::kSucceeded);
  for (const JobRecord& job : store_.ListChildren(theirs.name)) {
    EXPECT_EQ(job.state, JobState::kQueued);
    EXPECT_EQ(job.attempt, 0);
  }
  const JobRecord done = store_.ListChildren(ours.name).at(0);
  EXPECT_EQ(ReadFile(blobs_.Fetch(done.artifacts.at(0).digest.sha256)), "of " + done.name);
  EXPECT_TRUE(done.worker.ends_with("@remote")) << done.worker;
}

TEST_F(WorkerLoopTest, EndsWithoutWork) {
  options_.idle_exit = std::chrono::milliseconds(100);
  const std::atomic<bool> draining{false};
  RunWorker(options_, runner_, draining);
  EXPECT_TRUE(store_.ListWorkers().empty());
}

}  // namespace
}  // namespace color3d
