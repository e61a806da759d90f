// What a long computation is given besides its data and options. Whoever starts it owns all four;
// the references must outlive the call.
#pragma once

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/base/progress.h"

namespace color3d {

struct RunControl {
  ThreadPool& pool;  // the threads to use, never more
  CheckpointStore& checkpoints;
  ProgressObserver& progress;
  const CancellationToken& cancel;
};

}  // namespace color3d
