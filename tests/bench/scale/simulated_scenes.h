// The scenes of a simulation with their jobs, and the queue of jobs that may be claimed: the oldest
// first, as in the job store. A job may wait for the worker that has its blobs. Not thread-safe.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <queue>
#include <vector>

#include "tests/bench/scale/queue_model.h"

namespace color3d {

// Numbers a job in the order of creation.
using SimulatedJobId = int64_t;

class SimulatedScenes {
 public:
  // Requires: CheckModel has passed, and the model outlives this.
  explicit SimulatedScenes(const QueueModel& model);

  // Mean seconds of computing of a scene.
  double MeanSeconds() const;
  const SimulatedScene& SceneOf(SimulatedJobId job) const {
    return model_.kinds[scenes_[Place(job)].kind];
  }
  const SimulatedStage& StageOf(SimulatedJobId job) const {
    return SceneOf(job).stages[static_cast<size_t>(job % stride_)];
  }
  // Seconds of computing of this job, drawn by its number and the seed alone, so that any number of
  // workers has the same work.
  double SecondsOf(SimulatedJobId job) const;
  // Its input at this position of the scene.
  SimulatedJobId InputOf(SimulatedJobId job, int position) const {
    return job / stride_ * stride_ + position;
  }
  // A number for the files of its scene, which no job has.
  int64_t FilesOf(SimulatedJobId job) const { return model_.scenes * stride_ + job / stride_; }

  bool AllSubmitted() const { return submitted_ == model_.scenes; }
  bool AllEnded() const { return finished_ + failed_ == model_.scenes; }
  int64_t finished() const { return finished_; }
  int64_t failed() const { return failed_; }

  // Submits the next scene. Requires: there is one.
  void Submit(double now);
  // Puts a job into the queue, unless its scene has failed.
  void Queue(SimulatedJobId job, double now);
  // Returns true if there is a job for this worker.
  bool HasWork(int64_t worker);
  // Takes its first job out of the queue and notes how long it waited.
  std::optional<SimulatedJobId> Take(int64_t worker, double now);
  // Ends a job and queues those that waited for it alone. The first of them prefers the worker and
  // is returned: it is for this worker alone until Offer.
  std::optional<SimulatedJobId> Finish(SimulatedJobId job, int64_t worker, double now);
  // Gives a job that still waits for its preferred worker to all.
  void Offer(SimulatedJobId job);
  // Counts a lost worker; the scene fails with the last one that the model allows. Returns the
  // number so far, 0 if the scene has failed.
  int Lose(SimulatedJobId job);

  // Seconds of computing that the last checkpoint has.
  double SavedSeconds(SimulatedJobId job) const { return Job(job).saved_seconds; }
  void Save(SimulatedJobId job, double seconds) {
    Job(job).saved_seconds += static_cast<float>(seconds);
  }
  // Seconds that jobs waited in the queue; their order changes.
  std::vector<float>& waits() { return waits_; }

 private:
  struct JobState {
    double queued_since = 0.0;
    float saved_seconds = 0.0F;
    uint8_t open_inputs = 0;
    uint8_t losses = 0;
    bool prefers_worker = false;
  };
  struct SceneState {
    uint8_t kind = 0;
    bool has_failed = false;
  };
  // The first job for this worker; it stays in the queue.
  std::optional<SimulatedJobId> First(int64_t worker);
  size_t Place(SimulatedJobId job) const { return static_cast<size_t>(job / stride_); }
  JobState& Job(SimulatedJobId job) { return jobs_[static_cast<size_t>(job)]; }
  const JobState& Job(SimulatedJobId job) const { return jobs_[static_cast<size_t>(job)]; }

  const QueueModel& model_;
  const int64_t stride_;  // between the first jobs of scenes
  std::vector<SceneState> scenes_;
  std::vector<JobState> jobs_;
  std::vector<std::vector<std::vector<int>>> dependants_;  // by kind and stage
  std::priority_queue<SimulatedJobId, std::vector<SimulatedJobId>, std::greater<>> ready_;
  std::vector<std::optional<SimulatedJobId>> preferring_;  // by worker
  std::vector<float> waits_;
  int64_t submitted_ = 0;
  int64_t finished_ = 0;
  int64_t failed_ = 0;
};

}  // namespace color3d
