// Interface of the method library to the inference worker (calls, queue, batches), like
// stage_runner.h for jobs.
#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <vector>

#include "color3d/internal/v1/inference.pb.h"
#include "server/storage/worker_blobs.h"
#include "server/store/user_models.h"

namespace color3d {

// One picture of a batch. `error` is set if it has no answer.
struct LiveTask {
  const internal::v1::ColorizeImageRequest* request = nullptr;
  internal::v1::ColorizeImageResponse* response = nullptr;
  std::exception_ptr error;
};

// Not thread-safe.
class LiveEngine {
 public:
  virtual ~LiveEngine() = default;
  // Loads shared data, so that the first picture does not wait for it.
  virtual void WarmUp() = 0;
  // Answers all pictures together; errors of one do not affect the others.
  virtual void Colorize(std::vector<LiveTask>& tasks) = 0;
};

struct LiveEngineSetup {
  WorkerBlobs& blobs;  // must outlive the engine
  UserModels models;
  int threads = 1;
  int64_t cache_bytes = int64_t{512} << 20;    // size of the colorizer cache
  int64_t picture_bytes = int64_t{256} << 20;  // size of the cache of pictures with strokes
};

// Implemented in core_live_engine.cc.
std::unique_ptr<LiveEngine> MakeLiveEngine(const LiveEngineSetup& setup);

}  // namespace color3d
