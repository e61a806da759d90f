// Imports a film of one camera: its frames are the views, without poses unless these are requested
// and found. For the import stage only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/scene/import_options.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/film_options.h"

namespace color3d {

// Returns the film among the files of a scene: a video file, or "frames/" for pictures there.
// Requires: the scene is laid out as a film (DetectCapture).
std::string FindFilm(const std::vector<std::string>& files);

// Writes kScene, kImportFacts and, for videos and with deflicker, the frames in grey as
// kGivenViews; with poses also kMovingRegions and kSfmLog. Of `import`, only held-out frames and
// options of structure-from-motion have an effect. Frames that cannot be decoded are left out;
// warnings name them, and blank and torn ones. Throws Error{kInvalidArgument}: an unreadable film,
// no frame or one frame in the requested part, more than kMaxFilmFrames, frames too small for a
// movie, of different sizes or with names that differ in their extension only, a rate for a video
// file, a held-out camera.
void ImportFilm(const std::string& film,
                const FilmOptions& options,
                const ImportOptions& import,
                StageContext& context);

}  // namespace color3d
