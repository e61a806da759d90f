// Chroma on fixed geometry, on plain inputs: the engine behind FitChroma. Internal to the splat
// module.
#pragma once

#include <functional>
#include <vector>

#include "core/splat/geometry/geometry_trainer.h"
#include "core/splat/training/trainer.h"

namespace color3d {

struct ChromaProblem {
  std::vector<PosedCamera> training;
  ChromaTargetSource targets;  // may return null for a view that has no colours
  // For measurements, may be empty: called after the closed form, after every round of conjugate
  // gradients and at growing intervals of Adam, with a way to get the model of that moment.
  std::function<void(int64_t iteration, const std::function<GaussianModel()>& model)> snapshot;
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
