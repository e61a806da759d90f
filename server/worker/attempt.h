// One attempt at a job, from claim to publication: scratch folder, inputs, stage cache, the stage,
// and its results or failure. Not thread-safe.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <string>

#include "core/trace/tracer.h"
#include "server/storage/data_folder.h"
#include "server/storage/worker_blobs.h"
#include "server/store/user_models.h"
#include "server/store/worker_store.h"
#include "server/worker/lease_keeper.h"
#include "server/worker/stage_runner.h"

namespace color3d {

struct AttemptContext {
  WorkerStore& store;            // used by the thread of the worker
  WorkerStore& heartbeat_store;  // used by the heartbeat thread; with a connection of its own
  WorkerBlobs& blobs;
  StageRunner& runner;
  DataPaths paths;
  LeaseTiming timing;
  std::chrono::milliseconds checkpoint_interval{20'000};
  int threads = 1;
  // Part of the key of the stage cache: results of other builds are not reused.
  std::string code_version;
  const UserModels& models;
  FileDigests& digests;
  const std::atomic<bool>& draining;
  // Called on the heartbeat thread while a job runs.
  std::function<void(const JobRecord&)> on_heartbeat;
  Tracer* tracer = nullptr;  // records the attempt; null: does not
};

// Requeues the job without counting the attempt. Does not throw.
void ReturnJob(WorkerStore& store, const JobRecord& job);

// Does not throw: the outcome is stored or, if that fails, left to the end of the lease.
// `shares_process`: other attempts run in this process; peak memory is then that of all of them.
void RunAttempt(const AttemptContext& context, const JobRecord& job, bool shares_process = false);

}  // namespace color3d
