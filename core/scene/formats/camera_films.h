// Films of several cameras that saw one scene. Frames become views where films are decoded
// (core/stage/film); here is which films there are, and what the files beside them say of the
// cameras.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

struct CameraFilm {
  std::string camera;  // unique: as told, else the film's name
  std::string file;    // relative to the scene's folder: a video file, or a folder of pictures
  View view;           // where has_pose: camera, lens and pose; without name, picture and moment
  double time_offset_s = 0.0;  // to be added to the film's own times, finite
  bool has_pose = true;        // the same of all films
  bool is_pictures = false;    // likewise
};

// Width and height in px of a film, as people see it.
using FilmSize = std::function<std::pair<int, int>(const std::string& file)>;

// Sorted by camera; empty where the scene has no two films:
// - a transforms.json whose frames name films, one each, with a pose, or none of them with one, and
//   no time, but perhaps with a `time_offset` in seconds, where the cameras' clocks differ or one
//   began later;
// - a poses_bounds.npy (LLFF, as DyNeRF and Neural 3D Video have it) with as many films beside it
// as
//   it has rows, in the order of their names;
// - films without such a file and without photos, or folders of pictures in frames/: no poses.
// Throws Error{kInvalidArgument}: films and photos in one file, some films with a pose and some
// without, a film that is missing or named twice, two cameras of one name, numbers of films and
// poses that differ, cameras that do not fit the film's shape, a file that names one film, pictures
// beside folders of pictures, two films that are copies of each other.
std::vector<CameraFilm> ReadCameraFilms(const std::filesystem::path& scene_folder,
                                        const FilmSize& size_of);

}  // namespace color3d
