// What the unary calls of each client keep in memory: requests that wait or are worked on, and
// answers that it has not taken yet. A client that sends much or reads nothing gets no more than a
// share; the others go on. A client is a connection.
#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace color3d {

// Thread-safe.
class CallMemory {
 public:
  // The share is the budget divided by the clients that hold something, so that all together hold
  // some multiple of it at most: 2.9 times with 10 clients that come one after the other, 5.2 times
  // with 100.
  explicit CallMemory(int64_t budget_bytes) : budget_bytes_(budget_bytes) {}

  // `bytes` may be negative: what the client does not hold any more.
  void Add(const std::string& client, int64_t bytes);
  // Throws Error{kUnavailable}, OVERLOADED, when the client holds its share already, not counted
  // `own` bytes.
  void RequireShare(const std::string& client, int64_t own = 0) const;
  int64_t held_bytes() const;

 private:
  const int64_t budget_bytes_;
  mutable std::mutex mutex_;
  int64_t all_ = 0;
  std::map<std::string, int64_t> held_;  // by client
};

// Ends one unary call, and lives until the client has taken the answer or is gone.
class UnaryReactor final : public grpc::ServerUnaryReactor {
 public:
  UnaryReactor(CallMemory& memory, std::string client)
      : memory_(memory), client_(std::move(client)) {}
  ~UnaryReactor() override { memory_.Add(client_, -bytes_); }
  // The message, and what it takes on its way.
  void Hold(const google::protobuf::Message& message);
  // As CallMemory, of the client's other calls.
  void RequireShare() const { memory_.RequireShare(client_, bytes_); }
  void OnDone() override { delete this; }

 private:
  CallMemory& memory_;
  const std::string client_;
  int64_t bytes_ = 0;
};

}  // namespace color3d
