// A film as a scene: its frames are the views, all of one camera that is not known, unless its
// poses are asked for and found. For the import stage only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/scene/import_options.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/options/film_options.h"

namespace color3d {

// The film among the files of a scene: a video file, or "frames/" for pictures in that folder.
// Requires: the scene is laid out as a film (DetectCapture).
std::string FindFilm(const std::vector<std::string>& files);

// Leaves kScene, kImportFacts and, of a video file or where exposure is made steady, the frames in
// grey as kGivenViews; with poses kMovingRegions and kSfmLog, too. Of `import`, every eighth frame
// held out and, for poses, what is said of structure-from-motion count. Frames that cannot be
// decoded are left out; those, and blank and torn ones, are named in a warning. Throws
// Error{kInvalidArgument}: no film that can be read, nothing between the times that are asked for,
// one frame, more than kMaxFilmFrames (with the stride and the length that would do), frames that
// are too small for a movie, of different sizes or of names that differ in their endings only, a
// rate for a video file, a camera to hold out.
void ImportFilm(const std::string& film,
                const FilmOptions& options,
                const ImportOptions& import,
                StageContext& context);

}  // namespace color3d
