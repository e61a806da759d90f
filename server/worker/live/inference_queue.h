// Queue of calls and the thread that answers them in batches, oldest first. Thread-safe.
#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include <chrono>
#include <deque>
#include <thread>
#include <vector>

#include "color3d/internal/v1/inference.grpc.pb.h"
#include "core/base/mutex.h"
#include "server/worker/live/live_engine.h"

namespace color3d {

class InferenceQueue final : public internal::v1::InferenceService::CallbackService {
 public:
  InferenceQueue(LiveEngine& engine, int max_batch, size_t max_waiting);
  // Answers waiting calls with UNAVAILABLE; waits for the running batch.
  ~InferenceQueue() override;

  grpc::ServerUnaryReactor* ColorizeImage(grpc::CallbackServerContext* context,
                                          const internal::v1::ColorizeImageRequest* request,
                                          internal::v1::ColorizeImageResponse* response) override;

  struct State {
    bool idle = true;
    std::chrono::steady_clock::duration
        since{};  // time since the last change between idle and busy
    std::chrono::steady_clock::duration batch{};  // duration of the running batch; 0: none
    int64_t pictures = 0;                         // answered so far
  };
  State state() const;

 private:
  using SteadyClock = std::chrono::steady_clock;
  struct Waiting {
    grpc::CallbackServerContext* context = nullptr;
    grpc::ServerUnaryReactor* reactor = nullptr;
    LiveTask task;
  };
  void Loop();
  // Returns an empty batch at the end.
  std::vector<Waiting> Take();
  void Answer(std::vector<Waiting> batch);

  LiveEngine& engine_;
  const size_t max_batch_;
  const size_t max_waiting_;
  mutable Mutex mutex_;
  CondVar wake_;
  std::deque<Waiting> waiting_ COLOR3D_GUARDED_BY(mutex_);
  bool stopping_ COLOR3D_GUARDED_BY(mutex_) = false;
  bool busy_ COLOR3D_GUARDED_BY(mutex_) = true;  // loading, at first
  SteadyClock::time_point changed_ COLOR3D_GUARDED_BY(mutex_) = SteadyClock::now();
  SteadyClock::time_point batch_start_ COLOR3D_GUARDED_BY(mutex_) = SteadyClock::now();
  int64_t pictures_ COLOR3D_GUARDED_BY(mutex_) = 0;
  std::thread thread_;
};

}  // namespace color3d
