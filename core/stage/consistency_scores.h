// ME and TC of a whole scene, for the evaluate stage only.
#pragma once

#include <filesystem>
#include <map>
#include <optional>

#include "core/base/parallel.h"
#include "core/metrics/consistency.h"
#include "core/scene/scene.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/stage.h"

namespace color3d {

struct ConsistencyScores {
  Consistency rendered;              // pictures of the coloured model
  Consistency colored;               // the photos with the colours of views_ab/*
  std::optional<Consistency> truth;  // the true colours: what the photos themselves leave
};

// Over ConsistencyPairs of all views in order of their names, training and held-out ones alike, at
// no more than 500 px; matches come from the model's own depth. `truth`: colour photos by view; the
// truth's own scores need those of every view in the pairs. Reads views_ab/* from the context.
// Throws Error{kCancelled}.
ConsistencyScores ScoreConsistency(const Scene& scene,
                                   const GaussianModel& model,
                                   const std::map<int, std::filesystem::path>& truth,
                                   ThreadPool& pool,
                                   const StageContext& context);

}  // namespace color3d
