// Films of cameras with poses as a scene that moves. For the import stage only.
#pragma once

#include "core/scene/import.h"
#include "core/stage/film/import_film.h"

namespace color3d {

// False, and nothing done, when the scene has no such films (core/scene/posed_films.h). Else every
// camera's frames become views "CAMERA/f000012.png" with the camera's pose and the frame's time.
// FilmOptions asks for a part and a stride of moments, on the time that all cameras share and from
// the first frame of all; of frames where their clocks share no moments. Leaves kScene,
// kImportFacts and the frames in grey as kGivenViews. Decodes one frame at a time. Frames that
// cannot be decoded are left out and named in a warning. Throws Error{kInvalidArgument}: what
// ReadPosedFilms, ImportFilm and FinishPosedScene refuse.
bool ImportPosedFilms(const ImportOptions& options, const FilmOptions& film, StageContext& context);

}  // namespace color3d
