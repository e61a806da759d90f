// Sparse points that come with poses, but without what sees them. For core/scene only.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// The points of the PLY that `ply_file_path` of a transforms.json names among the scene's files,
// else of a sparse_pc.ply or points3d.ply in its folder; empty where there is none. `scene` has its
// views; a point lists those into whose picture it falls, and a point that fewer than two see is
// left out. Points are in the frame of the poses; where far more of them are seen with
// `applied_transform` applied, or taken back, so it is done. `warnings` (may be null) receives
// which file is used, or why not.
std::vector<SparsePoint> ReadGivenPoints(const nlohmann::json& transforms,
                                         const std::string& file_name,
                                         const std::filesystem::path& scene_folder,
                                         const Scene& scene,
                                         std::vector<std::string>* warnings);

}  // namespace color3d
