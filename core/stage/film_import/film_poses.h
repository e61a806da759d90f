// Poses of the frames of one moving camera that filmed moving objects (DYNAMIC.md "Poses of
// films"). For the import stage only.
#pragma once

#include <filesystem>

#include "core/scene/import/import.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {

// Least share of the frames of a camera that must have poses.
inline constexpr double kLeastShareWithPoses = 0.8;

// Estimates the poses of a film. `scene`: a film without poses; `image_file` is relative to
// `frames_root`. If at least 80 % of its frames belong to one shot and get a pose, `scene` becomes
// a dynamic scene of these frames with points; for a standing camera a relief (scene/relief.h),
// with a warning. Otherwise the film stays as it is, and a warning gives the reason. Publishes
// kMovingRegions of the frames with poses, and kSfmLog if structure-from-motion ran. `facts`
// receives the findings in any case. Throws Error: kCancelled, and for unreadable frames.
void FindFilmPoses(const std::filesystem::path& frames_root,
                   const ImportOptions& options,
                   StageContext& context,
                   Scene* scene,
                   ImportFacts* facts);

}  // namespace color3d
