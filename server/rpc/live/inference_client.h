// Calls to the resident inference worker. Thread-safe; never blocks.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "color3d/internal/v1/inference.grpc.pb.h"

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

  bool available() const { return stub_ != nullptr; }
  // Calls the worker to life ahead of the first picture.
  void WarmUp() const;
  // Keeps the worker from being drained while what this returns lives.
  std::shared_ptr<void> Hold() const { return link_.hold ? link_.hold() : nullptr; }
  // `done` is called once, on one of gRPC's threads, with the worker's status; a worker that dies
  // or does not answer in time gives UNAVAILABLE with RetryInfo (INFERENCE_LOST). To cancel:
  // call->context.TryCancel().
  void Start(const std::shared_ptr<Call>& call,
             std::chrono::system_clock::time_point deadline,
             std::function<void(const grpc::Status&)> done) const;

 private:
  InferenceLink link_;
  std::unique_ptr<internal::v1::InferenceService::Stub> stub_;
};

}  // namespace color3d
