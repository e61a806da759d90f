// Connection to one server: stubs, time limits and retries. Thread-safe; no call blocks longer than
// its time limit.
#pragma once

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "client/lib/rpc_error.h"
#include "color3d/v1/admin.grpc.pb.h"
#include "color3d/v1/blob.grpc.pb.h"
#include "color3d/v1/colorizer.grpc.pb.h"
#include "color3d/v1/job.grpc.pb.h"
#include "color3d/v1/scene.grpc.pb.h"
#include "color3d/v1/server.grpc.pb.h"
#include "core/base/cancellation.h"
#include "google/bytestream/bytestream.grpc.pb.h"

namespace color3d::client {

inline constexpr char kDefaultServer[] = "127.0.0.1:50551";

// Delays between attempts: 0.2 s, doubling up to 3 s, for at most `patience` after the last
// success. Not thread-safe.
class Backoff {
 public:
  explicit Backoff(std::chrono::milliseconds patience = std::chrono::seconds(30));
  // Call it after a success.
  void Reset();
  // Returns false if patience is exhausted; else sleeps, at least `at_least`. Throws
  // Error{kCancelled} as soon as `cancel` is set.
  bool Wait(const CancellationToken& cancel,
            std::chrono::milliseconds at_least = std::chrono::milliseconds(0));

 private:
  std::chrono::milliseconds patience_;
  std::chrono::milliseconds next_;
  std::chrono::steady_clock::time_point since_;
};

// Address and credentials of a server.
struct ServerTarget {
  std::string address = kDefaultServer;    // HOST:PORT, unix:PATH, or https://HOST:PORT for TLS
  std::filesystem::path ca;                // PEM: roots in place of the system's; TLS
  std::filesystem::path certificate, key;  // PEM, for servers that require one; TLS
  std::string token;                       // empty: none
  std::string traceparent = {};            // W3C, sent with each call; empty: none
  // Called when a busy server makes the client wait; may be empty.
  std::function<void(const std::string&)> on_wait = {};
  // Maximum time to wait for an unreachable server.
  std::chrono::milliseconds patience = std::chrono::seconds(30);
  // Set if no address was given: returns that of a server of this machine, which it may start.
  // Replaces `address` when a connection is made.
  std::function<std::string()> own_server = {};

  bool UsesTls() const;
  // Without the scheme.
  std::string HostPort() const;
};

class Connection {
 public:
  // Waits at most 4 s for the server. `cancel` must outlive the connection; it ends retries and
  // transfers. Throws Error{kUnavailable} that says how to start a server. Throws
  // Error{kInvalidArgument} for a malformed address, for a token that would travel unencrypted to
  // another machine, and for files that cannot be read. Throws what `own_server` throws.
  Connection(const ServerTarget& server, const CancellationToken& cancel);

  const std::string& address() const { return address_; }
  const CancellationToken& cancel() const { return cancel_; }
  // Returns a Backoff with the target's patience.
  Backoff NewBackoff() const { return Backoff(patience_); }
  // Reports the wait for a busy server to on_wait.
  void ReportWait(const RpcError& error) const;

  v1::SceneService::Stub& scenes() { return *scenes_; }
  v1::JobService::Stub& jobs() { return *jobs_; }
  v1::BlobService::Stub& blobs() { return *blobs_; }
  v1::ServerService::Stub& server() { return *server_; }
  v1::AdminService::Stub& admin() { return *admin_; }
  v1::ColorizerService::Stub& colorizers() { return *colorizers_; }
  google::bytestream::ByteStream::Stub& bytes() { return *bytes_; }

  // Makes one unary call, e.g. Call(&v1::JobService::Stub::GetJob, connection.jobs(), request).
  // Retries while the server is unreachable, and for ten minutes while it is busy (requests that
  // create something carry a request_id, so retries are safe). Throws RpcError.
  template <typename Stub, typename Request, typename Response>
  Response Call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                Stub& stub,
                const Request& request,
                std::chrono::seconds time_limit = std::chrono::seconds(30)) {
    Response response;
    Retry(
        [&](grpc::ClientContext* context) {
          response.Clear();
          return (stub.*method)(context, request, &response);
        },
        time_limit);
    return response;
  }

 private:
  Connection(const CancellationToken& cancel, const ServerTarget& found);
  void Retry(const std::function<grpc::Status(grpc::ClientContext*)>& call,
             std::chrono::seconds time_limit);

  std::string address_;
  const std::function<void(const std::string&)> on_wait_;
  const std::chrono::milliseconds patience_;
  const CancellationToken& cancel_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::SceneService::Stub> scenes_;
  std::unique_ptr<v1::JobService::Stub> jobs_;
  std::unique_ptr<v1::BlobService::Stub> blobs_;
  std::unique_ptr<v1::ServerService::Stub> server_;
  std::unique_ptr<v1::AdminService::Stub> admin_;
  std::unique_ptr<v1::ColorizerService::Stub> colorizers_;
  std::unique_ptr<google::bytestream::ByteStream::Stub> bytes_;
};

// Waits while a server is busy, ten minutes at most. The connection must outlive it. Not
// thread-safe.
class FullServerWait {
 public:
  explicit FullServerWait(const Connection& connection) : connection_(connection) { Reset(); }
  // Call it after a success.
  void Reset() { since_ = std::chrono::steady_clock::now(); }
  // Returns true after the delay that the server asked for, or as soon as `keep_going` returns
  // false. Returns false at once for other errors and if patience is exhausted. Throws
  // Error{kCancelled} as Backoff, unless there is a `keep_going`.
  bool Wait(const RpcError& error, const std::function<bool()>& keep_going = {});

 private:
  const Connection& connection_;
  std::chrono::steady_clock::time_point since_;
};

// Returns version, limits, models and presets of the server. Throws RpcError.
v1::ServerInfo GetServerInfo(Connection& connection);

// "cannot reach a server at ...: start one with ...".
Error UnreachableError(const std::string& address);

// "lost the server at ...": for a server that answered before.
Error ConnectionLostError(const std::string& address);

}  // namespace color3d::client
