// The worker process: claims one job after the other until it is told to stop or has grown too big.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "server/store/user_models.h"
#include "server/worker/lease_keeper.h"
#include "server/worker/live/live_engine.h"
#include "server/worker/stage_runner.h"
#include "server/worker/supervision/worker_settings.h"

namespace color3d {

struct WorkerOptions {
  std::filesystem::path data_folder;
  std::string name = "worker-1";  // its id is "<name>-<pid>"
  int threads = 1;
  LeaseTiming timing;
  std::chrono::milliseconds checkpoint_interval{20'000};
  std::chrono::milliseconds poll{250};
  int64_t retry_backoff_ms = WorkerSettings().retry_backoff_ms;
  int64_t reserve_mib = WorkerSettings().reserve_mib;  // disk space to keep free
  // The process ends (and is started afresh) when it is idle above this, or after so many jobs:
  // torch's memory grows with the number of distinct picture sizes.
  int64_t recycle_memory_bytes = int64_t{2} << 30;
  int recycle_jobs = 200;
  // Personalize jobs of one encoder that run at once, sharing it; fewer when memory is short.
  int batch_scenes = 8;
  pid_t parent = 0;  // 0: started by hand
  std::string code_version;
  std::string release;  // the server's, or no job is given
  UserModels models;
};

// Returns when `draining` turns true, the parent is gone or the process should be recycled.
void RunWorker(const WorkerOptions& options,
               StageRunner& runner,
               const std::atomic<bool>& draining);

// Parts of a worker program, one for each of its two roles.
struct WorkerProgram {
  std::unique_ptr<StageRunner> (*make_runner)();
  std::unique_ptr<LiveEngine> (*make_engine)(const LiveEngineSetup&);  // --inference
};

// The whole program: command line, log, signals. Returns the exit status.
int WorkerMain(int argc, char** argv, const WorkerProgram& program);

}  // namespace color3d
