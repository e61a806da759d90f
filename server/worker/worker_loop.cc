#include "server/worker/worker_loop.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <thread>

#include "color3d/v1/job.pb.h"
#include "core/base/memory.h"
#include "core/catalogue/stages.h"
#include "server/base/service_error.h"
#include "server/ops/process.h"
#include "server/storage/file_blob_store.h"
#include "server/store/sqlite_job_store.h"
#include "server/worker/attempt.h"
#include "server/worker/attempt_batch.h"

namespace color3d {
namespace {

// Free memory required for another scene: decoder, optimiser, averages and activations.
constexpr int64_t kSceneMemoryBytes = int64_t{512} << 20;

// Also empty for a damaged spec, which the attempt reports.
std::string EncoderOf(const JobRecord& job) {
  v1::JobSpec spec;
  spec.ParseFromString(job.spec);
  return spec.personalize().encoder();
}

class WorkerLoop {
 public:
  WorkerLoop(const WorkerOptions& options, StageRunner& runner, const std::atomic<bool>& draining)
      : options_(options),
        id_(options.name + "-" + std::to_string(::getpid())),
        paths_(options.data_folder),
        store_(paths_.Store(), StoreRole::kWorker, SystemClocks(), Store(options)),
        heartbeat_store_(paths_.Store(), StoreRole::kWorker, SystemClocks(), Store(options)),
        blobs_(paths_.Blobs(), {options.reserve_mib << 20}),
        draining_(draining),
        context_{store_,
                 heartbeat_store_,
                 blobs_,
                 runner,
                 paths_,
                 options.timing,
                 options.checkpoint_interval,
                 options.threads,
                 options.code_version,
                 options_.models,
                 digests_,
                 draining,
                 [this](const JobRecord& job) { ReportSelf(heartbeat_store_, job.name); }} {}

  void Run();

 private:
  static StoreOptions Store(const WorkerOptions& options) {
    StoreOptions store;
    store.retry_backoff_ms = options.retry_backoff_ms;
    store.program_version = options.release;
    return store;
  }
  bool Finished() const {
    return draining_.load() || (options_.parent != 0 && ::getppid() != options_.parent);
  }
  void ReportSelf(WorkerStore& store, const std::string& job) const;
  bool ShouldRecycle() const;
  // Claims and runs one job or a batch; returns false if there was none.
  bool Turn();
  void RunBatch(const JobRecord& first);
  // Returns true if another scene may join the `running` ones.
  bool HasRoom(int running) const;
  // Claims the next job of this kind and encoder; none if there is none or the queue is unreadable.
  std::optional<JobRecord> ClaimForBatch(const std::string& kind, const std::string& encoder);

  const WorkerOptions options_;
  const std::string id_;
  const DataPaths paths_;
  SqliteJobStore store_;
  SqliteJobStore heartbeat_store_;
  FileBlobStore blobs_;
  FileDigests digests_;
  const std::atomic<bool>& draining_;
  const AttemptContext context_;
  int jobs_done_ = 0;
};

// Reports the state for listings and to the supervisor. Errors are only logged.
void WorkerLoop::ReportSelf(WorkerStore& store, const std::string& job) const {
  try {
    store.UpdateWorker({id_, ::getpid(), job, ResidentMemoryBytes(), 0});
  } catch (const Error& e) {
    spdlog::warn("{} cannot report its state: {}", id_, e.what());
  }
}

bool WorkerLoop::ShouldRecycle() const {
  if (jobs_done_ == 0) return false;
  const int64_t memory = ResidentMemoryBytes();
  if (memory <= options_.recycle_memory_bytes && jobs_done_ < options_.recycle_jobs) return false;
  spdlog::info("{} ends after {} jobs with {} MiB, to be restarted", id_, jobs_done_, memory >> 20);
  return true;
}

bool WorkerLoop::Turn() {
  const std::optional<JobRecord> job = store_.Claim(id_, options_.timing.lease.count());
  if (!job) return false;
  ReportSelf(store_, job->name);
  const Stage* stage = FindStage(job->kind);
  // A job that has lost a worker may have killed it, so it runs alone.
  if (stage != nullptr && stage->runs_in_batch && options_.batch_scenes > 1 && job->attempt <= 1) {
    RunBatch(*job);
  } else {
    RunAttempt(context_, *job);
    ++jobs_done_;
  }
  ReportSelf(store_, "");
  return true;
}

bool WorkerLoop::HasRoom(int running) const {
  return running < options_.batch_scenes && !Finished() &&
         ResidentMemoryBytes() < options_.recycle_memory_bytes &&
         AvailableMemoryBytes() > kSceneMemoryBytes;
}

std::optional<JobRecord> WorkerLoop::ClaimForBatch(const std::string& kind,
                                                   const std::string& encoder) {
  const auto has_encoder = [&](const JobRecord& job) { return EncoderOf(job) == encoder; };
  try {
    return store_.ClaimForBatch(id_, options_.timing.lease.count(), kind, has_encoder);
  } catch (const Error& e) {
    spdlog::warn("{} cannot claim more jobs for its batch: {}", id_, e.what());
    return std::nullopt;
  }
}

// Continuous batching: scenes join while there is room and leave when they are done. One joins per
// round, so that idle workers get their share of the queue.
void WorkerLoop::RunBatch(const JobRecord& first) {
  AttemptBatch batch(context_);
  batch.Start(first);
  const std::string encoder = EncoderOf(first);
  while (batch.size() > 0) {
    if (HasRoom(batch.size())) {
      if (const auto other = ClaimForBatch(first.kind, encoder)) batch.Start(*other);
    }
    jobs_done_ += batch.Reap(options_.poll);
  }
}

void WorkerLoop::Run() {
  spdlog::info(
      "{} is ready with {} threads, {} MiB", id_, options_.threads, ResidentMemoryBytes() >> 20);
  auto next_report = std::chrono::steady_clock::now();
  while (!Finished() && !ShouldRecycle()) {
    bool worked = false;
    try {
      if (std::chrono::steady_clock::now() >= next_report) {
        ReportSelf(store_, "");
        next_report = std::chrono::steady_clock::now() + std::chrono::seconds(5);
      }
      worked = Turn();
    } catch (const std::exception& e) {
      if (HasReason(e, ErrorReason::kWorkerVersion)) throw;
      spdlog::error("{}: {}", id_, e.what());
    }
    if (!worked) std::this_thread::sleep_for(options_.poll);
  }
  try {
    store_.RemoveWorker(id_);
  } catch (const Error& e) {
    spdlog::warn("{}: {}", id_, e.what());
  }
}

}  // namespace

void RunWorker(const WorkerOptions& options,
               StageRunner& runner,
               const std::atomic<bool>& draining) {
  WorkerLoop loop(options, runner, draining);
  loop.Run();
}

}  // namespace color3d
