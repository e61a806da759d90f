// Plans of jobs, as the server makes them, for `color3d plan` and `color3d colorize`.
#pragma once

#include <optional>

#include "client/lib/connection.h"
#include "client/lib/progress_display.h"
#include "color3d/v1/job.pb.h"

namespace color3d::client {

// Asks the server for the plan of a job that is to be submitted and prints it. nullopt for servers
// of an older release, which cannot plan.
std::optional<v1::JobPlan> ShowPlan(Connection& connection,
                                    const v1::JobSpec& spec,
                                    ProgressDisplay& display);

}  // namespace color3d::client
