// What the chroma of a scene may keep in memory.
#pragma once

#include "core/scene/scene.h"
#include "core/splat/chroma/chroma_options.h"
#include "core/splat/model/gaussian_model.h"

namespace color3d {

inline constexpr size_t kFramesLikePhotos = 64;

// Frames may be many: small budgets, unless they are as few as photos and nothing in them moves.
inline ChromaOptions ChromaWithinMemory(const ChromaOptions& options,
                                        const Scene& scene,
                                        const GaussianModel& geometry) {
  const bool as_photos = geometry.motion.size() == 0 && scene.views.size() <= kFramesLikePhotos;
  return scene.IsDynamic() && !as_photos ? ForManyFrames(options) : options;
}

}  // namespace color3d
