// One attempt at one job, from claim to publication: scratch folder, inputs, stage cache, the stage
// itself, and what becomes of its results or of its failure.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <string>

#include "server/storage/blob_store.h"
#include "server/storage/data_folder.h"
#include "server/store/user_models.h"
#include "server/store/worker_store.h"
#include "server/worker/lease_keeper.h"
#include "server/worker/stage_runner.h"

namespace color3d {

struct AttemptContext {
  WorkerStore& store;            // the worker's thread
  WorkerStore& heartbeat_store;  // the heartbeat thread
  BlobStore& blobs;
  StageRunner& runner;
  DataPaths paths;
  LeaseTiming timing;
  std::chrono::milliseconds checkpoint_interval{20'000};
  int threads = 1;
  // Part of the stage cache's key: results of other code are not reused.
  std::string code_version;
  const UserModels& models;
  FileDigests& digests;
  const std::atomic<bool>& draining;
  // Called on the heartbeat thread while a job runs.
  std::function<void(const JobRecord&)> on_heartbeat;
};

// Back to the queue, without counting the attempt. Never throws.
void GiveBack(WorkerStore& store, const JobRecord& job);

// Never throws: whatever happens is written to the store, or, when that is impossible, left to the
// lease's end.
// `shares_process`: other attempts run in it, too; peak memory is then that of all together.
void RunAttempt(const AttemptContext& context, const JobRecord& job, bool shares_process = false);

}  // namespace color3d
