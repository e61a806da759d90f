// Discrete-event simulation of the queue: workers claim the jobs of many scenes from servers that
// share one database and one store of blobs. Deterministic: equal models give equal results.
#pragma once

#include "tests/bench/scale/queue_model.h"

namespace color3d {

// Runs until every scene has ended. Throws like CheckModel.
QueueResult SimulateQueue(const QueueModel& model);

}  // namespace color3d
