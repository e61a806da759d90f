// One RPC to a model server: deadline, cancellation with the job, and errors. Internal to this
// folder.
#pragma once

#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <functional>
#include <string>
#include <thread>

#include "core/base/cancellation.h"
#include "core/base/error.h"
#include "core/base/mutex.h"

namespace color3d {

// Cancels the RPC soon after the token is set, while this object lives.
class CancelWatch {
 public:
  CancelWatch(grpc::ClientContext& context, const CancellationToken& cancel);
  ~CancelWatch();
  CancelWatch(const CancelWatch&) = delete;
  CancelWatch& operator=(const CancelWatch&) = delete;

 private:
  Mutex mutex_;
  CondVar wake_;
  bool done_ COLOR3D_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

// Sleeps; throws Error{kCancelled} as soon as the token is set.
void SleepUnlessCancelled(std::chrono::milliseconds time, const CancellationToken& cancel);

// Returns an error that names the backend, the problem and the remedy. Requires: `status` is not
// OK.
Error BackendError(const std::string& name, const std::string& target, const grpc::Status& status);

}  // namespace color3d
