// RunControl without progress, cancellation or checkpoints, for tests and benchmarks.
#pragma once

#include "core/base/run_control.h"

namespace color3d {

class QuietRun {
 public:
  // `threads`: as in ThreadPool.
  explicit QuietRun(int threads = 0) : pool_(threads) {}

  ThreadPool& pool() { return pool_; }
  CancellationToken& cancel() { return cancel_; }
  RunControl control() { return {pool_, checkpoints_, progress_, cancel_}; }
  // `observer` must outlive the computation.
  RunControl ReportingTo(ProgressObserver& progress) {
    return {pool_, checkpoints_, progress, cancel_};
  }

 private:
  ThreadPool pool_;
  NoCheckpoints checkpoints_;
  NullObserver progress_;
  CancellationToken cancel_;
};

}  // namespace color3d
