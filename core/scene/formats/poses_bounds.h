// Reads LLFF's poses_bounds.npy for films. For core/scene only.
#pragma once

#include <filesystem>
#include <vector>

#include "core/scene/formats/camera_films.h"

namespace color3d {

inline constexpr char kPosesBounds[] = "poses_bounds.npy";

// Reads N rows of 17 numbers: 3 x 5 (axes down, right, backwards, position; height, width, focal
// length in px), then the nearest and farthest depth, which are ignored. Row i belongs to the i-th
// film by name directly in the folder. Empty without films. Throws Error{kInvalidArgument} for
// another shape, different numbers of rows and films, axes that are no rotation, and sizes or focal
// lengths that are not positive.
std::vector<CameraFilm> ReadPosesBounds(const std::filesystem::path& scene_folder);

}  // namespace color3d
