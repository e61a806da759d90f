#include "tests/bench/scale/simulated_scenes.h"

#include <algorithm>
#include <cmath>

#include "core/base/random.h"

namespace color3d {
namespace {

int64_t MostStages(const QueueModel& model) {
  size_t most = 0;
  for (const SimulatedScene& kind : model.kinds) most = std::max(most, kind.stages.size());
  return static_cast<int64_t>(most);
}

}  // namespace

SimulatedScenes::SimulatedScenes(const QueueModel& model)
    : model_(model),
      stride_(MostStages(model)),
      scenes_(static_cast<size_t>(model.scenes)),
      jobs_(static_cast<size_t>(model.scenes * stride_)),
      preferring_(static_cast<size_t>(model.workers)) {
  for (const SimulatedScene& kind : model.kinds) {
    auto& dependants = dependants_.emplace_back(kind.stages.size());
    for (size_t i = 0; i < kind.stages.size(); ++i) {
      for (const int input : kind.stages[i].inputs) {
        dependants[static_cast<size_t>(input)].push_back(static_cast<int>(i));
      }
    }
  }
  for (size_t i = 0; i < scenes_.size(); ++i) {
    const uint64_t bits = MixedBits(model.seed ^ MixedBits(i + 1));
    scenes_[i].kind = static_cast<uint8_t>(bits % model.kinds.size());
  }
  waits_.reserve(jobs_.size());
}

double SimulatedScenes::MeanSeconds() const {
  double seconds = 0.0;
  for (const SimulatedScene& kind : model_.kinds) {
    for (const SimulatedStage& stage : kind.stages) seconds += stage.seconds;
  }
  return seconds / static_cast<double>(model_.kinds.size());
}

double SimulatedScenes::SecondsOf(SimulatedJobId job) const {
  const double mean = StageOf(job).seconds;
  if (model_.spread <= 0.0) return mean;
  Random random(MixedBits(model_.seed + MixedBits(static_cast<uint64_t>(job) + 1)));
  const double variance = std::log1p(model_.spread * model_.spread);
  return mean * std::exp(std::sqrt(variance) * random.NextNormal() - 0.5 * variance);
}

void SimulatedScenes::Submit(double now) {
  const SimulatedJobId first = submitted_++ * stride_;
  const auto& stages = SceneOf(first).stages;
  for (size_t i = 0; i < stages.size(); ++i) {
    const SimulatedJobId job = first + static_cast<SimulatedJobId>(i);
    Job(job).open_inputs = static_cast<uint8_t>(stages[i].inputs.size());
    if (stages[i].inputs.empty()) Queue(job, now);
  }
}

void SimulatedScenes::Queue(SimulatedJobId job, double now) {
  if (scenes_[Place(job)].has_failed) return;
  Job(job).queued_since = now;
  ready_.push(job);
}

std::optional<SimulatedJobId> SimulatedScenes::First(int64_t worker) {
  while (!ready_.empty() && scenes_[Place(ready_.top())].has_failed) ready_.pop();
  std::optional<SimulatedJobId>& own = preferring_[static_cast<size_t>(worker)];
  if (own && (!Job(*own).prefers_worker || scenes_[Place(*own)].has_failed)) own.reset();
  if (ready_.empty()) return own;
  return own ? std::min(*own, ready_.top()) : ready_.top();
}

bool SimulatedScenes::HasWork(int64_t worker) { return First(worker).has_value(); }

std::optional<SimulatedJobId> SimulatedScenes::Take(int64_t worker, double now) {
  const std::optional<SimulatedJobId> job = First(worker);
  if (!job) return std::nullopt;
  if (Job(*job).prefers_worker) {
    Job(*job).prefers_worker = false;
    preferring_[static_cast<size_t>(worker)].reset();
  } else {
    ready_.pop();
  }
  waits_.push_back(static_cast<float>(now - Job(*job).queued_since));
  return job;
}

std::optional<SimulatedJobId> SimulatedScenes::Finish(SimulatedJobId job,
                                                      int64_t worker,
                                                      double now) {
  const SceneState& scene = scenes_[Place(job)];
  const auto position = static_cast<size_t>(job % stride_);
  std::optional<SimulatedJobId> first;
  for (const int dependant : dependants_[scene.kind][position]) {
    const SimulatedJobId next = InputOf(job, dependant);
    if (--Job(next).open_inputs > 0 || scene.has_failed) continue;
    // An earlier job may still prefer this worker, which claimed another before it.
    const std::optional<SimulatedJobId>& own = preferring_[static_cast<size_t>(worker)];
    if (first || (own && Job(*own).prefers_worker)) {
      Queue(next, now);
      continue;
    }
    Job(next).queued_since = now;
    Job(next).prefers_worker = true;
    first = next;
  }
  if (first) preferring_[static_cast<size_t>(worker)] = first;
  const bool is_last = position + 1 == model_.kinds[scene.kind].stages.size();
  if (is_last && !scene.has_failed) ++finished_;
  return first;
}

void SimulatedScenes::Offer(SimulatedJobId job) {
  if (!Job(job).prefers_worker) return;
  Job(job).prefers_worker = false;
  ready_.push(job);
}

int SimulatedScenes::Lose(SimulatedJobId job) {
  SceneState& scene = scenes_[Place(job)];
  if (scene.has_failed) return 0;
  if (++Job(job).losses < model_.most_losses) return Job(job).losses;
  scene.has_failed = true;
  ++failed_;
  return 0;
}

}  // namespace color3d
