// Attempts that run in one worker at once, each on a thread of its own with its own lease,
// heartbeats, checkpoints and cancellation. One of them can fail, be cancelled or lose its lease
// without the others noticing; only the end of the process ends them all, and then each goes on
// from its checkpoint. Used by the worker's thread.
#pragma once

#include <list>
#include <thread>

#include "core/base/mutex.h"
#include "server/worker/attempt.h"

namespace color3d {

class AttemptBatch {
 public:
  explicit AttemptBatch(const AttemptContext& context) : context_(context) {}
  // Waits for all.
  ~AttemptBatch();

  int size() const { return static_cast<int>(running_.size()); }
  void Start(const JobRecord& job);
  // Waits until an attempt has ended or the time is over; returns how many have ended.
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
