// Calls of the page that correct a scene, listed in client/studio/README.md.
#pragma once

#include "client/studio/correct/corrections.h"
#include "client/studio/studio_routes.h"

namespace color3d::client {

// `corrections` must outlive the server.
void AddCorrectRoutes(Corrections& corrections, const StudioRoutes& routes);

}  // namespace color3d::client
