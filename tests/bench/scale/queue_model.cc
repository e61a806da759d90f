#include "tests/bench/scale/queue_model.h"

#include <cmath>

#include "core/base/error.h"

namespace color3d {
namespace {

void RequireModel(bool good, const char* problem) {
  if (!good) throw InvalidArgument("the model of the queue {}", problem);
}

}  // namespace

void CheckModel(const QueueModel& model) {
  RequireModel(model.workers > 0 && model.workers <= 1'000'000, "needs 1 to 1,000,000 workers");
  RequireModel(model.scenes > 0 && model.scenes <= 10'000'000, "needs 1 to 10,000,000 scenes");
  RequireModel(!model.kinds.empty() && model.kinds.size() < 256, "needs 1 to 255 kinds of scenes");
  for (const SimulatedScene& kind : model.kinds) {
    RequireModel(!kind.stages.empty() && kind.stages.size() < 256, "needs 1 to 255 stages a scene");
    for (size_t i = 0; i < kind.stages.size(); ++i) {
      for (const int input : kind.stages[i].inputs) {
        RequireModel(input >= 0 && input < static_cast<int>(i),
                     "has a stage whose input is no earlier stage");
      }
      RequireModel(kind.stages[i].seconds >= 0.0, "has a stage with a negative time");
    }
  }
  const ServiceTimes& t = model.times;
  for (const double value : {t.claim_read,
                             t.prepare_read,
                             t.claim_write,
                             t.join_write,
                             t.publish_write,
                             t.artifact_write,
                             t.heartbeat_write,
                             t.worker_write,
                             t.checkpoint_write,
                             t.call_cpu,
                             t.byte_cpu,
                             model.spread,
                             model.link_bytes_per_second,
                             model.blob_bytes_per_second,
                             model.attempt_seconds,
                             model.local_cpu,
                             model.progress,
                             model.heartbeat,
                             model.lease,
                             model.checkpoint,
                             model.retry_pause,
                             model.preference,
                             model.losses_per_hour,
                             model.preemptions_per_hour,
                             model.restart}) {
    RequireModel(value >= 0.0 && std::isfinite(value), "has a negative or infinite number");
  }
  RequireModel(model.poll > 0.0, "needs a pause of workers without work (poll) above 0");
  RequireModel(model.load == 0.0 || (model.load >= 0.01 && model.load <= 10.0),
               "has a load that is neither 0 nor between 0.01 and 10");
  RequireModel(model.writers >= 0 && model.readers >= 0 && model.cores >= 0 &&
                   model.cache_bytes >= 0 && model.most_losses > 0,
               "has a negative number");
}

}  // namespace color3d
