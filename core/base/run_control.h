// Threads, cancellation, progress and checkpoints of a long computation. The caller owns all four;
// the references must outlive the call.
#pragma once

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/base/progress.h"

namespace color3d {

struct RunControl {
  ThreadPool& pool;  // at most these threads are used
  CheckpointStore& checkpoints;
  ProgressObserver& progress;
  const CancellationToken& cancel;
};

}  // namespace color3d
