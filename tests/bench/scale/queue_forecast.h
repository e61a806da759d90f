// What the simulation expects of a run of the real queue on one machine.
#pragma once

#include <vector>

#include "tests/bench/scale/queue_model.h"
#include "tests/bench/scale/queue_run.h"

namespace color3d {

// Returns the model of the run's queue: its CPU as measured, the times of the database as given.
// The worker's own work for an attempt is set so that the simulation of this run takes as long as
// the run. Requires: the run had one worker.
QueueModel ModelOfRun(const QueueRun& one, const QueueRunOptions& options, ServiceTimes database);

// The same queue with another number of workers.
QueueResult Forecast(QueueModel model, int workers, const QueueRunOptions& options);

}  // namespace color3d
