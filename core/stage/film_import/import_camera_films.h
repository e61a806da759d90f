// Imports films of several cameras as a dynamic scene. For the import stage only.
#pragma once

#include "core/scene/import/import.h"
#include "core/stage/film_import/import_film.h"

namespace color3d {

// Returns false and does nothing if the scene has no such films (scene/formats/camera_films.h).
// Otherwise the frames of all cameras become views "CAMERA/f000012.png" (pictures keep their names)
// with times, and with poses from a file or estimated ones (camera_poses.h). FilmOptions select a
// part and a stride (footage.h). Writes kScene, kImportFacts, the frames of videos in grey as
// kGivenViews and, for estimated poses, kMovingRegions and kSfmLog. Decodes one frame at a time.
// Frames that cannot be decoded are left out with a warning. Throws Error{kInvalidArgument}: errors
// of ReadFootage, PlaceCameras and FinishPosedScene; cuts in films whose poses are estimated.
bool ImportCameraFilms(const ImportOptions& options,
                       const FilmOptions& film,
                       StageContext& context);

}  // namespace color3d
