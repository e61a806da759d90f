// Steadiness of the colours of a film or a dynamic scene, for scores.json.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "core/scene/scene.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// Scores "pairs", "followed", "tc_chroma", "chroma", "cdc", "cdc_1", "cdc_2" and "cdc_4"
// (TemporalConsistency) of the coloured frames ("colored_views"); of renders of the model
// ("rendered") and of the bound ("bound") where there are any; and of the true colours ("truth")
// when every view has them. `truth`: by view. Empty when views have no times, or no shot has two
// frames. Throws Error{kCancelled}.
nlohmann::ordered_json TemporalScores(const Scene& scene,
                                      const std::optional<GaussianModel>& model,
                                      const std::optional<GaussianModel>& bound,
                                      const std::map<int, std::filesystem::path>& truth,
                                      StageContext& context);

}  // namespace color3d
