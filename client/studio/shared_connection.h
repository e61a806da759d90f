// The connection to the service that all calls of the studio share. Thread-safe.
#pragma once

#include <memory>

#include "client/lib/connection.h"
#include "core/base/mutex.h"

namespace color3d::client {

class SharedConnection {
 public:
  // `cancel` must outlive the connection.
  SharedConnection(ServerTarget server, const CancellationToken& cancel)
      : server_(std::move(server)), cancel_(cancel) {}

  // The connection; made by the first call, and anew where a server of the user's own has ended,
  // which is then found or started. Throws as Connection.
  std::shared_ptr<Connection> Get();
  const CancellationToken& cancel() const { return cancel_; }

 private:
  const ServerTarget server_;
  const CancellationToken& cancel_;
  Mutex mutex_;
  std::shared_ptr<Connection> kept_ COLOR3D_GUARDED_BY(mutex_);
};

}  // namespace color3d::client
