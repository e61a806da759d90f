// Chroma on fixed geometry, on plain inputs: the engine behind FitChroma. Internal to the splat
// module.
#pragma once

#include <vector>

#include "core/splat/geometry_trainer.h"
#include "core/splat/trainer.h"

namespace color3d {

struct ChromaProblem {
  std::vector<PosedCamera> training;
  ChromaTargetSource targets;  // may return null for a view that has no colours
};

// As FitChroma.
GaussianModel FitChromaOn(const GaussianModel& geometry,
                          const ChromaProblem& problem,
                          const ChromaOptions& options,
                          ThreadPool& pool,
                          CheckpointStore& checkpoints,
                          ProgressObserver& progress,
                          const CancellationToken& cancel);

}  // namespace color3d
