// Films of several cameras of one scene: finds the films, and reads the cameras from the files
// beside them. Frames become views in core/stage/film_import.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

struct CameraFilm {
  std::string camera;  // unique: from the file, else the film's name
  std::string file;    // relative to the scene's folder: a video file, or a folder of pictures
  View view;           // if has_pose: camera, lens and pose; other fields are unset
  double time_offset_s = 0.0;  // to be added to the film's own times, finite
  bool has_pose = true;        // equal for all films
  bool is_pictures = false;    // equal for all films
};

// Returns width and height of a film as displayed, px.
using FilmSize = std::function<std::pair<int, int>(const std::string& file)>;

// Returns the films sorted by camera; empty if the scene has fewer than two. In order of
// preference:
// - a transforms.json whose frames name one film each. Either all have a pose or none has. No frame
//   has a time; each may have a `time_offset` in seconds, if clocks differ or a camera started
//   later.
// - a poses_bounds.npy (LLFF, as in DyNeRF and Neural 3D Video) with one row for each film beside
//   it, in the order of their names.
// - films without such a file and without photos, or folders of pictures in frames/: no poses.
// Throws Error{kInvalidArgument} for films and photos in one file, films of which only some have a
// pose, a film that is missing or named twice, two cameras of one name, different numbers of films
// and poses, a camera of another aspect ratio than its film, a file that names one film only,
// pictures beside folders of pictures, and two films that are copies of each other.
std::vector<CameraFilm> ReadCameraFilms(const std::filesystem::path& scene_folder,
                                        const FilmSize& size_of);

}  // namespace color3d
