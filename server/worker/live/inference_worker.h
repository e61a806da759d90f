// The inference worker: answers ColorizeImage calls of its server over a private socket. Calls that
// wait are taken together, whatever their scenes.
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
  // Waiting calls are still answered for so long when the worker is told to stop.
  std::chrono::milliseconds drain_grace{10'000};
  // Without work the process ends after a while, or sooner when it has grown big.
  std::chrono::milliseconds idle{15 * 60'000};
  int64_t recycle_memory_bytes = int64_t{2} << 30;
  // A batch that takes longer is stuck: the process is given up.
  std::chrono::milliseconds stuck{180'000};
};

// Returns when `draining` turns true, the parent is gone, or there was nothing to do. Throws
// Error{kFailedPrecondition} when it cannot listen.
void RunInference(const InferenceOptions& options,
                  LiveEngine& engine,
                  const std::atomic<bool>& draining);

}  // namespace color3d
