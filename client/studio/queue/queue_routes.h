// The studio's calls for the queue (client/studio/README.md).
#pragma once

#include "client/studio/queue/queue_calls.h"
#include "client/studio/studio_routes.h"

namespace color3d::client {

// Requires: `calls` outlives the server of the routes.
void AddQueueRoutes(const StudioRoutes& routes, QueueCalls& calls);

}  // namespace color3d::client
