// What the inference worker (calls, queue, batches) asks of the method library, as stage_runner.h
// is for jobs.
#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <vector>

#include "color3d/internal/v1/inference.pb.h"
#include "server/storage/blob_store.h"
#include "server/store/user_models.h"

namespace color3d {

// One picture of a batch. `error` is set when there is no answer to it.
struct LiveTask {
  const internal::v1::ColorizeImageRequest* request = nullptr;
  internal::v1::ColorizeImageResponse* response = nullptr;
  std::exception_ptr error;
};

// Used by one thread.
class LiveEngine {
 public:
  virtual ~LiveEngine() = default;
  // Loads what every picture needs, so that the first does not wait for it.
  virtual void WarmUp() = 0;
  // Answers all of them together; what is wrong with one does not touch the others.
  virtual void Colorize(std::vector<LiveTask>& tasks) = 0;
};

struct LiveEngineSetup {
  BlobStore& blobs;  // outlives the engine
  UserModels models;
  int threads = 1;
  int64_t cache_bytes = int64_t{512} << 20;  // of colorizers
};

// The real one (core_live_engine.cc).
std::unique_ptr<LiveEngine> MakeLiveEngine(const LiveEngineSetup& setup);

}  // namespace color3d
