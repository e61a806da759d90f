// Films of cameras with poses as a scene that moves. For the import stage only.
#pragma once

#include "core/scene/import.h"
#include "core/stage/film/import_film.h"

namespace color3d {

// False, and nothing done, when the scene has no such films (core/scene/posed_films.h). Else every
// camera's frames, as FilmOptions asks for them, become views "CAMERA/f000012.png" with the
// camera's pose and the frame's time; leaves kScene, kImportFacts and the frames in grey as
// kGivenViews. Decodes one frame at a time. Frames that cannot be decoded are left out and named in
// a warning. Throws Error{kInvalidArgument}: what ReadPosedFilms, ImportFilm and FinishPosedScene
// refuse.
bool ImportPosedFilms(const ImportOptions& options, const FilmOptions& film, StageContext& context);

}  // namespace color3d
