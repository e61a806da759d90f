// Films of several cameras as a scene that moves. For the import stage only.
#pragma once

#include "core/scene/import/import.h"
#include "core/stage/film_import/import_film.h"

namespace color3d {

// False, and nothing done, when the scene has no such films (scene/formats/camera_films.h). Else
// every camera's frames become views "CAMERA/f000012.png" (of pictures their own names) with the
// frame's time and the camera's pose, as told or, where none is told, as it is found
// (camera_poses.h). FilmOptions asks for a part and a stride (footage.h). Leaves kScene,
// kImportFacts, the frames of videos in grey as kGivenViews and, where poses were looked for,
// kMovingRegions and kSfmLog. Decodes one frame at a time. Frames that cannot be decoded are left
// out and named in a warning. Throws Error{kInvalidArgument}: what ReadFootage, PlaceCameras and
// FinishPosedScene refuse; films that are cut, where poses are looked for.
bool ImportCameraFilms(const ImportOptions& options,
                       const FilmOptions& film,
                       StageContext& context);

}  // namespace color3d
