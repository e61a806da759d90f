// Temporal consistency of the colours of a film or a dynamic scene, for scores.json. For stages
// only.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "core/scene/scene.h"
#include "core/splat/model/gaussian_model.h"
#include "core/stage/context/stage_context.h"

namespace color3d {

// TemporalConsistency of the coloured frames ("colored_views"), of renders of `model` ("rendered")
// and of `bound`, the same geometry under true colours ("bound"), and of the true colours if every
// view has them ("truth"). `truth`: by view. Empty if the views have no times or no shot has two
// frames. Throws Error{kCancelled}.
nlohmann::ordered_json TemporalScores(const Scene& scene,
                                      const std::optional<GaussianModel>& model,
                                      const std::optional<GaussianModel>& bound,
                                      const std::map<int, std::filesystem::path>& truth,
                                      StageContext& context);

}  // namespace color3d
