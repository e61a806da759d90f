#include "server/worker/worker_loop.h"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <set>
#include <thread>

#include "core/base/memory.h"
#include "core/base/process/host_name.h"
#include "core/catalogue/stages.h"
#include "server/base/service_error.h"
#include "server/ops/process.h"
#include "server/worker/attempt.h"
#include "server/worker/attempt_batch.h"
#include "server/worker/remote/server_access.h"
#include "server/worker/remote/worker_place.h"

namespace color3d {
namespace {

// Free memory required for another scene: decoder, optimiser, averages and activations.
constexpr int64_t kSceneMemoryBytes = int64_t{512} << 20;

// As in JobNeeds.
std::set<std::string> NamesOfModels(const UserModels& models) {
  std::set<std::string> names;
  for (const auto& [name, file] : models.files) names.insert(ModelNeed(name));
  for (const auto& [name, address] : models.backends) names.insert(BackendNeed(name));
  return names;
}

// The server refuses this worker, and would do so again.
bool IsRefusal(const std::exception& e) {
  const auto* error = dynamic_cast<const Error*>(&e);
  if (error == nullptr) return false;
  return error->code() == ErrorCode::kUnauthenticated ||
         error->code() == ErrorCode::kPermissionDenied || HasReason(e, ErrorReason::kWorkerVersion);
}

class WorkerLoop {
 public:
  WorkerLoop(const WorkerOptions& options,
             ServerAccess& server,
             StageRunner& runner,
             const std::atomic<bool>& draining)
      : options_(options),
        id_(options.name + "-" + std::to_string(::getpid())),
        paths_(options.data_folder),
        server_(server),
        store_(server.store()),
        heartbeat_store_(server.heartbeat_store()),
        draining_(draining),
        context_{store_,
                 heartbeat_store_,
                 server.blobs(),
                 runner,
                 paths_,
                 options_.timing,
                 options_.checkpoint_interval,
                 options_.threads,
                 options_.code_version,
                 options_.models,
                 digests_,
                 draining,
                 [this](const JobRecord& job) { ReportSelf(heartbeat_store_, job.name); },
                 options_.tracer.get()} {
    const int64_t memory = std::min(MachineMemoryBytes(), OwnMemoryLimitBytes());
    facts_.worker_id = id_;
    facts_.pid = ::getpid();
    facts_.machine = HostName("worker");
    facts_.release = options_.release;
    facts_.threads = options_.threads;
    facts_.memory_limit_bytes = memory == INT64_MAX ? 0 : memory;
    facts_.simd = options_.simd;
  }

  void Run();

 private:
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
  ClaimTerms Terms() const;
  // Claims a job that can run in the batch of `first`; none if there is none or the queue is
  // unreadable.
  std::optional<JobRecord> ClaimForBatch(const JobRecord& first);
  void LogProblem(const std::exception& e);
  bool IsIdleTooLong() const;

  const WorkerOptions options_;
  const std::string id_;
  const DataPaths paths_;
  ServerAccess& server_;
  WorkerStore& store_;
  WorkerStore& heartbeat_store_;
  FileDigests digests_;
  const std::atomic<bool>& draining_;
  const AttemptContext context_;
  WorkerRecord facts_;  // that do not change
  std::atomic<int> jobs_done_{0};
  std::chrono::steady_clock::time_point last_work_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point next_complaint_;
};

// Reports the state for listings and to the supervisor. Errors are only logged.
void WorkerLoop::ReportSelf(WorkerStore& store, const std::string& job) const {
  try {
    WorkerRecord self = facts_;
    self.job = job;
    self.memory_bytes = ResidentMemoryBytes();
    const CacheUse cache = server_.cache_use();
    self.cache_bytes = cache.bytes;
    self.cache_limit_bytes = cache.limit_bytes;
    self.cache_hit_bytes = cache.hit_bytes;
    self.cache_miss_bytes = cache.miss_bytes;
    self.finished_jobs = jobs_done_.load();
    store.UpdateWorker(self);
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

ClaimTerms WorkerLoop::Terms() const {
  ClaimTerms terms{.worker = id_,
                   .lease_ms = options_.timing.lease.count(),
                   .memory_limit_bytes = facts_.memory_limit_bytes,
                   .models = {},
                   .batch_kind = {},
                   .batch_group = {}};
  // A worker on the server's machine has all models of the server.
  if (!options_.server.address.empty()) terms.models = NamesOfModels(options_.models);
  return terms;
}

// While the server is away, the same problem occurs several times a second.
void WorkerLoop::LogProblem(const std::exception& e) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_complaint_) return;
  next_complaint_ = now + std::chrono::seconds(10);
  spdlog::error("{}: {}", id_, e.what());
}

bool WorkerLoop::Turn() {
  const std::optional<JobRecord> job = store_.Claim(Terms());
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

std::optional<JobRecord> WorkerLoop::ClaimForBatch(const JobRecord& first) {
  ClaimTerms terms = Terms();
  terms.batch_kind = first.kind;
  terms.batch_group = first.needs.batch_group;
  try {
    return store_.Claim(terms);
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
  while (batch.size() > 0) {
    if (HasRoom(batch.size())) {
      if (const auto other = ClaimForBatch(first)) batch.Start(*other);
    }
    jobs_done_ += batch.Reap(options_.poll);
  }
}

void WorkerLoop::Run() {
  spdlog::info(
      "{} is ready with {} threads, {} MiB", id_, options_.threads, ResidentMemoryBytes() >> 20);
  auto next_report = std::chrono::steady_clock::now();
  while (!Finished() && !ShouldRecycle() && !IsIdleTooLong()) {
    bool worked = false;
    try {
      if (std::chrono::steady_clock::now() >= next_report) {
        ReportSelf(store_, "");
        next_report = std::chrono::steady_clock::now() + std::chrono::seconds(5);
      }
      worked = Turn();
    } catch (const std::exception& e) {
      if (IsRefusal(e)) throw;
      LogProblem(e);
    }
    if (worked) last_work_ = std::chrono::steady_clock::now();
    if (!worked) std::this_thread::sleep_for(options_.poll);
  }
  try {
    store_.RemoveWorker(id_);
  } catch (const Error& e) {
    spdlog::warn("{}: {}", id_, e.what());
  }
}

bool WorkerLoop::IsIdleTooLong() const {
  if (options_.idle_exit.count() == 0) return false;
  if (std::chrono::steady_clock::now() - last_work_ < options_.idle_exit) return false;
  spdlog::info("{} ends: there was no job for {} s", id_, options_.idle_exit.count() / 1000);
  return true;
}

// Waits for the server; returns nothing if the worker must end before.
std::optional<Greeting> GreetServer(const WorkerOptions& options,
                                    const std::atomic<bool>& draining) {
  WorkerLink link(options.server, {std::chrono::seconds(10), std::chrono::seconds(0)});
  const auto begun = std::chrono::steady_clock::now();
  while (!draining.load()) {
    try {
      return link.Greet(options.release);
    } catch (const Error& e) {
      if (e.code() != ErrorCode::kUnavailable) throw;
      spdlog::warn("{}; trying again", e.what());
    }
    const auto waited = std::chrono::steady_clock::now() - begun;
    if (options.idle_exit.count() > 0 && waited > options.idle_exit) return std::nullopt;
    const auto next = std::chrono::steady_clock::now() + std::chrono::seconds(2);
    while (!draining.load() && std::chrono::steady_clock::now() < next) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }
  return std::nullopt;
}

// The same name must mean the same weights.
void RequireEqualModels(const UserModels& models, const Greeting& greeting) {
  FileDigests digests;
  for (const auto& [name, file] : models.files) {
    const auto theirs = greeting.models.find(name);
    if (theirs == greeting.models.end()) {
      spdlog::warn("the server has no model '{}', so no job needs it", name);
    } else if (theirs->second != Sha256Hex(DigestsOfModel(file, digests))) {
      throw Error(ErrorCode::kFailedPrecondition,
                  "the files of the model '{}' ({}) differ from the server's; copy its files with "
                  "their names, or leave out --model {}",
                  name,
                  file.string(),
                  name);
    }
  }
}

// Lines after the end of the access are dropped.
void SendLogs(const ServerAccess& server) {
  LogJobsTo([logs = std::weak_ptr(server.logs())](const std::string& job, const std::string& line) {
    if (const auto sender = logs.lock()) sender->Add(job, line);
  });
}

void RunElsewhere(WorkerOptions options, StageRunner& runner, const std::atomic<bool>& draining) {
  const std::optional<Greeting> greeting = GreetServer(options, draining);
  if (!greeting) return;
  RequireEqualModels(options.models, *greeting);
  using std::chrono::milliseconds;
  options.timing.lease = milliseconds(greeting->times.lease_ms);
  options.timing.heartbeat = milliseconds(greeting->times.heartbeat_ms);
  options.timing.stuck = milliseconds(greeting->times.stuck_ms);
  options.checkpoint_interval = milliseconds(greeting->times.checkpoint_ms);
  ServerAccess server(DataPaths(options.data_folder),
                      LinkTiming::For(options.timing.lease),
                      options.release,
                      options.server,
                      options.cache_bytes);
  SendLogs(server);
  WorkerLoop(options, server, runner, draining).Run();
}

}  // namespace

void RunWorker(const WorkerOptions& options,
               StageRunner& runner,
               const std::atomic<bool>& draining) {
  if (!options.server.address.empty()) return RunElsewhere(options, runner, draining);
  ServerAccess server(DataPaths(options.data_folder),
                      LinkTiming::For(options.timing.lease),
                      options.release,
                      options.reserve_mib << 20,
                      {options.name, options.cache_bytes});
  if (options.sends_logs) SendLogs(server);
  WorkerLoop(options, server, runner, draining).Run();
}

}  // namespace color3d
