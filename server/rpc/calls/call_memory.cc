#include "server/rpc/calls/call_memory.h"

#include "server/base/service_error.h"

namespace color3d {

void CallMemory::Add(const std::string& client, int64_t bytes) {
  if (bytes == 0) return;
  std::lock_guard lock(mutex_);
  all_ += bytes;
  int64_t& held = held_[client];
  held += bytes;
  if (held == 0) held_.erase(client);
}

void CallMemory::RequireShare(const std::string& client, int64_t own) const {
  std::lock_guard lock(mutex_);
  const auto held = held_.find(client);
  if (held == held_.end()) return;
  const int64_t others = held->second - own;
  if (others < budget_bytes_ / static_cast<int64_t>(held_.size())) return;
  throw ServiceError(ErrorReason::kOverloaded,
                     "calls of this connection hold {} MiB of the server's memory, requests that "
                     "wait and answers that were not read; let them end, then try again",
                     others >> 20);
}

int64_t CallMemory::held_bytes() const {
  std::lock_guard lock(mutex_);
  return all_;
}

void UnaryReactor::Hold(const google::protobuf::Message& message) {
  const auto bytes = static_cast<int64_t>(message.SpaceUsedLong() + message.ByteSizeLong());
  bytes_ += bytes;
  memory_.Add(client_, bytes);
}

}  // namespace color3d
