// Poses of a film's frames where one camera moves through a place, in part of which things move
// (DYNAMIC.md "Poses of films"). For the import stage only.
#pragma once

#include <filesystem>

#include "core/scene/import/import.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {

// The least share of a camera's frames that has poses when it goes on with them.
inline constexpr double kLeastShareWithPoses = 0.8;

// `scene`: a film without poses, whose pictures lie at their image_file below `frames_root`. When
// at least 80 % of its frames belong to one shot and find a place, makes it a dynamic scene of
// those frames, with points, and leaves kMovingRegions; where the camera stands still, a relief
// (scene/relief.h), with a warning. Otherwise the film stays as it is. What is
// left out, and why there are no poses, is a warning; what was found goes into `facts` either way.
// The log of structure-from-motion is left as kSfmLog when it ran. Throws Error: cancelled, frames
// that cannot be read.
void FindFilmPoses(const std::filesystem::path& frames_root,
                   const ImportOptions& options,
                   StageContext& context,
                   Scene* scene,
                   ImportFacts* facts);

}  // namespace color3d
