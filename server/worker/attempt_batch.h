// Concurrent attempts of one worker, each on its own thread with its own lease, heartbeats,
// checkpoints and cancellation. A failure, cancellation or lost lease of one does not affect the
// others; if the process ends, each resumes from its checkpoint. Not thread-safe.
#pragma once

#include <list>
#include <thread>

#include "core/base/mutex.h"
#include "server/worker/attempt.h"

namespace color3d {

class AttemptBatch {
 public:
  explicit AttemptBatch(const AttemptContext& context) : context_(context) {}
  // Waits for all attempts.
  ~AttemptBatch();

  int size() const { return static_cast<int>(running_.size()); }
  void Start(const JobRecord& job);
  // Waits until an attempt has ended or the time is over; returns the number of ended attempts.
  int Reap(std::chrono::milliseconds timeout);

 private:
  struct Running {
    std::thread thread;
    bool ended = false;  // guarded by mutex_
  };

  const AttemptContext& context_;
  Mutex mutex_;  // guards Running::ended
  CondVar ended_;
  std::list<Running> running_;
};

}  // namespace color3d
