#include "client/studio/shared_connection.h"

#include "client/lib/local_server.h"

namespace color3d::client {

std::shared_ptr<Connection> SharedConnection::Get() {
  const MutexLock lock(mutex_);
  const bool has_ended = kept_ && server_.own_server && !AcceptsConnections(kept_->address());
  if (!kept_ || has_ended) kept_ = std::make_shared<Connection>(server_, cancel_);
  return kept_;
}

}  // namespace color3d::client
