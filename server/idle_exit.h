// `color3d-server serve --idle-exit`: ends a server that nobody uses. Not thread-safe.
#pragma once

#include <chrono>
#include <memory>

#include "server/ops/idle_watch.h"
#include "server/rpc/rpc_server.h"
#include "server/store/job_store.h"

namespace color3d {

// Sends SIGTERM to this process after `limit` without calls of clients, open streams and unfinished
// jobs. Returns null for 0. Store and server must outlive the watch.
std::unique_ptr<IdleWatch> ExitWhenIdle(std::chrono::milliseconds limit,
                                        JobStore& store,
                                        const RpcServer& server);

}  // namespace color3d
