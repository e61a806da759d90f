#include "tests/bench/scale/queue_forecast.h"

#include <algorithm>
#include <thread>

#include "core/catalogue/stages.h"
#include "tests/bench/scale/queue_simulation.h"

namespace color3d {
namespace {

// Calls of an attempt in the simulation: claim, preparation, publication, one result; and its
// heartbeats.
double CallsOfAttempt(const QueueRunOptions& options, double progress) {
  constexpr double kCalls = 1 + 7 + 2 + 2;
  return kCalls + 1e-3 * options.stage_ms / progress;
}

}  // namespace

QueueModel ModelOfRun(const QueueRun& one, const QueueRunOptions& options, ServiceTimes database) {
  QueueModel model;
  SimulatedStage stage;
  stage.kind = kind::kSelectKeyView;
  stage.seconds = 1e-3 * options.stage_ms;
  stage.output_files = 1;
  stage.output_bytes = 100;
  model.kinds = {{{stage}}};
  model.cores = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  model.poll = options.elsewhere ? 1.0 : 0.25;
  model.cache_bytes = 1 << 20;
  model.times = database;
  model.times.call_cpu = one.server_cpu / CallsOfAttempt(options, model.progress);
  model.local_cpu = one.worker_cpu;
  const QueueResult ideal = Forecast(model, 1, options);
  model.attempt_seconds =
      std::max(0.0, one.seconds_per_job - ideal.makespan / options.jobs_per_worker);
  return model;
}

QueueResult Forecast(QueueModel model, int workers, const QueueRunOptions& options) {
  model.workers = workers;
  model.scenes = int64_t{workers} * options.jobs_per_worker;
  return SimulateQueue(model);
}

}  // namespace color3d
