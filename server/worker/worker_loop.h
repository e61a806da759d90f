// Loop of a worker process: runs one job after the other until it is stopped or too large.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "core/trace/tracer.h"
#include "server/store/user_models.h"
#include "server/worker/lease_keeper.h"
#include "server/worker/live/live_engine.h"
#include "server/worker/remote/worker_link.h"
#include "server/worker/stage_runner.h"
#include "server/worker/supervision/worker_settings.h"

namespace color3d {

struct WorkerOptions {
  // Of the server on this machine; or a folder of this worker, if `server` has an address.
  std::filesystem::path data_folder;
  WorkerTarget server;                      // on another machine; no address: on this one
  int64_t cache_bytes = int64_t{20} << 30;  // of the blobs of a server on another machine
  std::chrono::milliseconds idle_exit{0};   // ends after this time without a job; 0: never
  std::string name = "worker-1";            // the id is "<name>-<pid>"
  int threads = 1;
  LeaseTiming timing;
  std::chrono::milliseconds checkpoint_interval{20'000};
  std::chrono::milliseconds poll{250};
  int64_t reserve_mib = WorkerSettings().reserve_mib;  // disk space to keep free
  bool sends_logs = false;  // on the server's machine; those of others always do
  // The process ends (and is restarted) if it is idle above this memory or after this number of
  // jobs: the memory of torch grows with the number of distinct picture sizes.
  int64_t recycle_memory_bytes = int64_t{2} << 30;
  int recycle_jobs = 200;
  // Maximum number of concurrent personalize jobs that share an encoder; fewer if memory is short.
  int batch_scenes = 8;
  pid_t parent = 0;  // 0: started by hand
  std::string code_version;
  std::string release;  // for messages
  std::string simd;     // as in WorkerRecord
  UserModels models;
  std::shared_ptr<Tracer> tracer;  // records attempts; null: does not
};

// Returns when `draining` becomes true, the parent has ended, the process should be recycled, or
// there was no job for `idle_exit`. Throws Error if the server refuses this worker, e.g.
// WORKER_VERSION or ROLE_TOO_LOW.
void RunWorker(const WorkerOptions& options,
               StageRunner& runner,
               const std::atomic<bool>& draining);

// Parts of a worker program for its two roles.
struct WorkerProgram {
  std::unique_ptr<StageRunner> (*make_runner)();
  std::unique_ptr<LiveEngine> (*make_engine)(const LiveEngineSetup&);  // --inference
  std::string_view (*instruction_set)() = nullptr;
};

// Runs the whole program: command line, log, signals. Returns the exit status.
int WorkerMain(int argc, char** argv, const WorkerProgram& program);

}  // namespace color3d
