// Memory held by the unary calls of each client: pending requests and answers not sent yet. A
// client is a connection. One that sends much or reads nothing is limited to a share, so that the
// others go on.
#pragma once

#include <google/protobuf/message.h>
#include <grpcpp/support/server_callback.h>

#include <cstdint>
#include <map>
#include <string>

#include "core/base/mutex.h"

namespace color3d {

// Thread-safe.
class CallMemory {
 public:
  // The share is the budget divided by the number of clients that hold memory. The sum over all
  // clients is bounded by a multiple of the budget: 2.9 with 10 clients that arrive one after the
  // other, 5.2 with 100.
  explicit CallMemory(int64_t budget_bytes) : budget_bytes_(budget_bytes) {}

  // `bytes` may be negative, for memory that was released.
  void Add(const std::string& client, int64_t bytes);
  // Throws Error{kUnavailable}, OVERLOADED, if the client holds its share already, not counting
  // `own` bytes.
  void RequireShare(const std::string& client, int64_t own = 0) const;
  int64_t held_bytes() const;

 private:
  const int64_t budget_bytes_;
  mutable Mutex mutex_;
  int64_t all_ COLOR3D_GUARDED_BY(mutex_) = 0;
  std::map<std::string, int64_t> held_ COLOR3D_GUARDED_BY(mutex_);  // by client
};

// Ends one unary call. Lives until the client has received the answer or is gone.
class UnaryReactor final : public grpc::ServerUnaryReactor {
 public:
  UnaryReactor(CallMemory& memory, std::string client)
      : memory_(memory), client_(std::move(client)) {}
  ~UnaryReactor() override { memory_.Add(client_, -bytes_); }
  // Accounts for the memory of a message and its transport buffers.
  void Hold(const google::protobuf::Message& message);
  // As CallMemory::RequireShare, for the other calls of the client.
  void RequireShare() const { memory_.RequireShare(client_, bytes_); }
  void OnDone() override { delete this; }

 private:
  CallMemory& memory_;
  const std::string client_;
  int64_t bytes_ = 0;
};

}  // namespace color3d
