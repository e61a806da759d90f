// Calls to the resident inference worker. Thread-safe; never blocks.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "color3d/internal/v1/inference.grpc.pb.h"
#include "core/base/mutex.h"
#include "server/rpc/live/poison_watch.h"

namespace color3d {

// How to reach the worker and request its start.
struct InferenceLink {
  // gRPC address; empty: this server has no inference worker.
  std::string target;
  // Requests that the worker be started soon; cheap, callable from any thread.
  std::function<void()> demand;
  // A draining server keeps the worker running while the result exists.
  std::function<std::shared_ptr<void>()> hold;
  // Maximum time for one picture, including the start of the worker and queueing.
  std::chrono::milliseconds limit{120'000};
};

class InferenceClient {
 public:
  // One pending picture. Lives until `done` has returned.
  struct Call {
    grpc::ClientContext context;
    internal::v1::ColorizeImageRequest request;
    internal::v1::ColorizeImageResponse response;
  };

  explicit InferenceClient(InferenceLink link);

  bool available() const { return !link_.target.empty(); }
  // Starts the worker ahead of the first picture.
  void WarmUp() const;
  // Keeps the worker from being drained while the result exists.
  std::shared_ptr<void> Hold() const { return link_.hold ? link_.hold() : nullptr; }
  // `done` is called once, on a thread of gRPC or of the caller, with the worker's status. A worker
  // that dies or does not answer in time gives UNAVAILABLE with RetryInfo (INFERENCE_LOST).
  // Pictures that were with a worker when it died are each sent alone when they are resent, so that
  // the one that kills it is identified (FAILED_PRECONDITION, PICTURE_KILLS_WORKER). To cancel:
  // call->context.TryCancel().
  void Start(const std::shared_ptr<Call>& call,
             std::chrono::system_clock::time_point deadline,
             std::function<void(const grpc::Status&)> done);

 private:
  struct Order {
    std::shared_ptr<Call> call;
    std::chrono::system_clock::time_point deadline;
    std::function<void(const grpc::Status&)> done;
    LivePicture picture;  // empty: no worker had died when it arrived
  };
  // Sends all pictures that may be sent now.
  void Pump();
  void Send(const Order& order);
  using Stub = internal::v1::InferenceService::Stub;
  void OnEnd(const Order& order, const std::shared_ptr<Stub>& stub, const grpc::Status& status);

  InferenceLink link_;
  Mutex mutex_;
  std::shared_ptr<Stub> stub_ COLOR3D_GUARDED_BY(mutex_);  // to the present worker; null: none
  PoisonWatch watch_ COLOR3D_GUARDED_BY(mutex_);
  std::deque<Order> waiting_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d
