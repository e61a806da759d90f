// Memory budgets of the chroma solver.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/scene/scene.h"
#include "core/splat/chroma/chroma_options.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

inline constexpr size_t kFramesLikePhotos = 64;

// Sets small budgets for frames, unless they are as few as photos and the scene is static. Both
// budgets stay below shares of `memory_bytes`, the memory of the stage. The result of the solver
// does not depend on them.
inline ChromaOptions ChromaWithinMemory(ChromaOptions options,
                                        const Scene& scene,
                                        const GaussianModel& geometry,
                                        int64_t memory_bytes) {
  const bool as_photos = !geometry.IsDynamic() && scene.views.size() <= kFramesLikePhotos;
  if (scene.HasTimes() && !as_photos) options = ForManyFrames(options);
  options.memory_budget_bytes = std::min(options.memory_budget_bytes, memory_bytes / 2);
  options.target_budget_bytes = std::min(options.target_budget_bytes, memory_bytes / 8);
  return options;
}

}  // namespace color3d
