// Calls to the resident inference worker. Thread-safe; never blocks.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "color3d/internal/v1/inference.grpc.pb.h"
#include "server/rpc/live/poison_watch.h"

namespace color3d {

// How the worker is reached and called to life.
struct InferenceLink {
  // gRPC address; empty: this server has no inference worker.
  std::string target;
  // Asks for the worker to be running soon; cheap, from any thread.
  std::function<void()> demand;
  // While what this returns lives, a draining server leaves the worker running.
  std::function<std::shared_ptr<void>()> hold;
  // Longest time for one picture, with the start of the worker and the wait for its turn.
  std::chrono::milliseconds limit{120'000};
};

class InferenceClient {
 public:
  // One picture on its way. Lives until `done` has returned.
  struct Call {
    grpc::ClientContext context;
    internal::v1::ColorizeImageRequest request;
    internal::v1::ColorizeImageResponse response;
  };

  explicit InferenceClient(InferenceLink link);

  bool available() const { return !link_.target.empty(); }
  // Calls the worker to life ahead of the first picture.
  void WarmUp() const;
  // Keeps the worker from being drained while what this returns lives.
  std::shared_ptr<void> Hold() const { return link_.hold ? link_.hold() : nullptr; }
  // `done` is called once, on one of gRPC's threads or the caller's, with the worker's status; a
  // worker that dies or does not answer in time gives UNAVAILABLE with RetryInfo (INFERENCE_LOST).
  // Pictures that were with a worker when it died are each sent alone when they come again, so that
  // the one that kills it is found (FAILED_PRECONDITION, PICTURE_KILLS_WORKER) and takes no other
  // with it. To cancel: call->context.TryCancel().
  void Start(const std::shared_ptr<Call>& call,
             std::chrono::system_clock::time_point deadline,
             std::function<void(const grpc::Status&)> done);

 private:
  struct Order {
    std::shared_ptr<Call> call;
    std::chrono::system_clock::time_point deadline;
    std::function<void(const grpc::Status&)> done;
    LivePicture picture;  // empty: no worker had died when it came
  };
  // Sends what may be sent now.
  void Pump();
  void Send(const Order& order);
  using Stub = internal::v1::InferenceService::Stub;
  void OnEnd(const Order& order, const std::shared_ptr<Stub>& stub, const grpc::Status& status);

  InferenceLink link_;
  std::mutex mutex_;
  std::shared_ptr<Stub> stub_;  // to the present worker; null: there is none
  PoisonWatch watch_;
  std::deque<Order> waiting_;
};

}  // namespace color3d
