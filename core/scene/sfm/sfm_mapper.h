// Runs COLMAP's mapper, with thresholds as strict as the photos allow. For this folder only.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "core/scene/formats/colmap_model.h"
#include "core/scene/sfm/colmap_process.h"
#include "core/scene/sfm/sfm_matching.h"

namespace color3d {

// Thresholds of the mapper. Straight: a smaller angle between the first two photos, and no lens
// distortion until all cameras are registered; for forward motion, distortion and motion explain
// each other and the mapper fails with an absurd lens. Loose: fewer common points, too, which may
// join unrelated photos.
enum class Strictness { kDefault, kStraight, kLoose };

// Minimum number of registered photos.
inline constexpr size_t kMinPlaced = 3;

// Returns the plausible model with the most photos; nullopt if there is none. Models with too few
// points or an absurd lens are rejected. `attempt` names the run in messages and folders, `count`
// is the number of photos. Throws Error: cancelled, too slow.
std::optional<ColmapModel> MapPhotos(ColmapProcess& colmap,
                                     const SfmWorkspace& work,
                                     size_t count,
                                     const std::string& attempt,
                                     Strictness strictness);

}  // namespace color3d
