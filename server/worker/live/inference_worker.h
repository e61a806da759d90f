// The inference worker: answers ColorizeImage calls of its server over a private socket. Batches
// waiting calls of all scenes.
#pragma once

#include <sys/types.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

#include "server/storage/blob_store.h"
#include "server/worker/live/live_engine.h"

namespace color3d {

struct InferenceOptions {
  std::filesystem::path data_folder;
  std::string socket;  // name in the data folder's folder of sockets
  std::string name = "inference";
  pid_t parent = 0;  // 0: started by hand
  int max_batch = 8;
  size_t max_waiting = 256;
  // Maximum time to answer waiting calls after a stop was requested.
  std::chrono::milliseconds drain_grace{10'000};
  // The process ends after this time without work, or when idle above recycle_memory_bytes.
  std::chrono::milliseconds idle{15 * 60'000};
  int64_t recycle_memory_bytes = int64_t{2} << 30;
  // The process is ended if a batch takes longer.
  std::chrono::milliseconds stuck{180'000};
};

// Returns when `draining` becomes true, the parent has ended, or there was no work. Throws
// Error{kFailedPrecondition} if it cannot listen.
void RunInference(const InferenceOptions& options,
                  LiveEngine& engine,
                  const std::atomic<bool>& draining);

}  // namespace color3d
