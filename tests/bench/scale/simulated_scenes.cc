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
      jobs_(static_cast<size_t>(model.scenes * stride_)) {
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

std::optional<SimulatedJobId> SimulatedScenes::Take(double now) {
  while (!ready_.empty()) {
    const SimulatedJobId job = ready_.top();
    ready_.pop();
    if (scenes_[Place(job)].has_failed) continue;
    waits_.push_back(static_cast<float>(now - Job(job).queued_since));
    return job;
  }
  return std::nullopt;
}

void SimulatedScenes::Finish(SimulatedJobId job, double now) {
  const SceneState& scene = scenes_[Place(job)];
  const auto position = static_cast<size_t>(job % stride_);
  for (const int dependant : dependants_[scene.kind][position]) {
    const SimulatedJobId next = InputOf(job, dependant);
    if (--Job(next).open_inputs == 0) Queue(next, now);
  }
  const bool is_last = position + 1 == model_.kinds[scene.kind].stages.size();
  if (is_last && !scene.has_failed) ++finished_;
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
