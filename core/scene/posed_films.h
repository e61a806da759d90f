// Films whose cameras have poses: a rig that filmed one scene. Frames become views where films are
// decoded (core/stage/film); here is what the files beside them say of the cameras.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

struct PosedFilm {
  std::string camera;          // unique: as told, else the film's name
  std::string file;            // relative to the scene's folder
  View view;                   // its cameras, lens and pose; without name, picture and moment
  double time_offset_s = 0.0;  // to be added to the film's own times, finite
};

// Width and height in px of a film, as people see it.
using FilmSize = std::function<std::pair<int, int>(const std::string& file)>;

// A transforms.json whose frames name films, one each, with a pose and no time, but perhaps with a
// `time_offset` in seconds, where the cameras' clocks differ or one began later; or a
// poses_bounds.npy (LLFF, as DyNeRF and Neural 3D Video have it) with as many films beside it as it
// has rows, in the order of their names. Sorted by camera; empty where the scene is neither. Throws
// Error{kInvalidArgument}: films and photos in one file, a film that is missing or named twice, two
// cameras of one name, numbers of films and poses that differ, cameras that do not fit the film's
// shape, fewer than two films.
std::vector<PosedFilm> ReadPosedFilms(const std::filesystem::path& scene_folder,
                                      const FilmSize& size_of);

}  // namespace color3d
