// From matched features to cameras: COLMAP's mapper, as strict or loose as it takes. For this
// folder only.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "core/scene/formats/colmap_model.h"
#include "core/scene/sfm/colmap_process.h"
#include "core/scene/sfm/sfm_matching.h"

namespace color3d {

// How much the mapper insists on. Straight: a smaller angle between the first two photos, and no
// lens distortion until all cameras stand, because on walks straight ahead distortion and motion
// explain each other and the mapper gives up with an absurd lens. Loose: fewer common points, too,
// which may join what does not belong together.
enum class Strictness { kDefault, kStraight, kLoose };

// Fewer photos than this make no scene.
inline constexpr size_t kMinPlaced = 3;

// The plausible model with the most photos; nullopt when there is none: models with too few points
// or an absurd lens do not count. `attempt` names the run in messages and folders, `count` is the
// number of photos. Throws Error: cancelled, too slow.
std::optional<ColmapModel> MapPhotos(ColmapProcess& colmap,
                                     const SfmWorkspace& work,
                                     size_t count,
                                     const std::string& attempt,
                                     Strictness strictness);

}  // namespace color3d
