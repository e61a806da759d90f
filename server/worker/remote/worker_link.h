// Connection of a worker to its server: calls with time limits, and retries of those that may be
// repeated. Thread-safe.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>

#include "color3d/internal/v1/worker.grpc.pb.h"
#include "server/rpc/calls/worker_messages.h"

namespace color3d {

// What a server says to a new worker.
struct Greeting {
  WorkerTimes times;
  std::map<std::string, std::string> models;  // SHA-256 of DigestsOfModel, by name
};

// Address and credentials of a server.
struct WorkerTarget {
  std::string address;                     // HOST:PORT, unix:PATH, or https://HOST:PORT for TLS
  std::string token;                       // empty: none
  std::filesystem::path ca;                // PEM: roots in place of the system's; TLS
  std::filesystem::path certificate, key;  // PEM, for servers that require one; TLS

  bool UsesTls() const;
};

struct LinkTiming {
  std::chrono::milliseconds call{10'000};      // maximum time of one try
  std::chrono::milliseconds patience{40'000};  // maximum time of all tries of a call
  // Those for a server on whose leases the worker works: the worker gives up a job two thirds of a
  // lease after the last heartbeat.
  static LinkTiming For(std::chrono::milliseconds lease);
};

// Pauses between tries: 50 ms, doubling up to 2 s, until `patience` has passed since the last
// Reset. Not thread-safe.
class RetryPause {
 public:
  explicit RetryPause(std::chrono::milliseconds patience) : patience_(patience) { Reset(); }
  // Call it after progress.
  void Reset();
  // Sleeps; returns false at once if patience is exhausted.
  bool Wait();

 private:
  std::chrono::milliseconds patience_, next_{};
  std::chrono::steady_clock::time_point end_;
};

// Returns true if the server was not reached, did not answer in time, or was too busy.
bool IsWorthRetry(const grpc::Status& status);

class WorkerLink {
 public:
  using Stub = internal::v1::WorkerService::Stub;

  // Does not connect yet. Throws Error{kInvalidArgument} for a malformed address, for a token that
  // would travel unencrypted to another machine, and for files that cannot be read.
  WorkerLink(const WorkerTarget& target, const LinkTiming& timing);

  // Throws WORKER_VERSION, or Error{kUnavailable} if the server cannot be reached.
  Greeting Greet(const std::string& release, int32_t protocol = kWorkerProtocol);

  // Makes a unary call, e.g. Once(&Stub::Claim, request). Throws as ThrowIfFailed, and
  // Error{kUnavailable} if there is no answer in time.
  template <typename Request, typename Response>
  Response Once(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                const Request& request) {
    return Call(method, request, std::chrono::milliseconds(0));
  }
  // The same with further tries, for calls that may be repeated.
  template <typename Request, typename Response>
  Response Retry(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                 const Request& request) {
    return Call(method, request, timing_.patience);
  }
  // The same with a third of the patience, for calls whose caller repeats them.
  template <typename Request, typename Response>
  Response RetryBriefly(grpc::Status (Stub::*method)(grpc::ClientContext*,
                                                     const Request&,
                                                     Response*),
                        const Request& request) {
    return Call(method, request, timing_.patience / 3);
  }

  Stub& stub() const { return *stub_; }
  const LinkTiming& timing() const { return timing_; }
  // Waits a moment for the connection, and adds the token and the time limit.
  void Prepare(grpc::ClientContext* context, std::chrono::milliseconds limit) const;
  // Throws as ThrowIfFailed, and names the server if it was not reached.
  void Require(const grpc::Status& status) const;

 private:
  template <typename Request, typename Response>
  Response Call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                const Request& request,
                std::chrono::milliseconds patience) {
    Response response;
    RunCall(
        [&](grpc::ClientContext* context) {
          response.Clear();
          return (*stub_.*method)(context, request, &response);
        },
        patience);
    return response;
  }
  void RunCall(const std::function<grpc::Status(grpc::ClientContext*)>& call,
               std::chrono::milliseconds patience) const;

  const std::string address_, authorization_;
  const LinkTiming timing_;
  const std::shared_ptr<grpc::Channel> channel_;
  const std::unique_ptr<Stub> stub_;
};

}  // namespace color3d
