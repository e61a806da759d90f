// How steady the colours of a film or of a scene that moves are, for scores.json. For the stages of
// this layer only.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "core/scene/scene.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Of the frames in colour ("colored_views"), of pictures of the model ("rendered") and of the same
// geometry under true colours ("bound") where there are such, and of the true colours when every
// view has them ("truth"): "pairs", "followed", "tc_chroma", "chroma", "cdc", "cdc_1", "cdc_2",
// "cdc_4" (TemporalConsistency). `truth`: by view. Empty when views have no moments, or no shot has
// two frames. Throws Error{kCancelled}.
nlohmann::ordered_json TemporalScores(const Scene& scene,
                                      const std::optional<GaussianModel>& model,
                                      const std::optional<GaussianModel>& bound,
                                      const std::map<int, std::filesystem::path>& truth,
                                      StageContext& context);

}  // namespace color3d
