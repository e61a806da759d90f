// Sparse points that come with poses but without tracks. For core/scene only.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// Reads the PLY that `ply_file_path` of a transforms.json names among the scene's files, else
// sparse_pc.ply or points3d.ply in its folder. Returns no points if there is none. Requires:
// `scene` has its views. A point lists the views whose picture it falls into; points in fewer than
// two views are left out. Points are in the frame of the poses; if far more of them are visible
// with `applied_transform`, or with its inverse, it is applied. `warnings` (may be null) receives
// the file used, or why none is.
std::vector<SparsePoint> ReadGivenPoints(const nlohmann::json& transforms,
                                         const std::string& file_name,
                                         const std::filesystem::path& scene_folder,
                                         const Scene& scene,
                                         std::vector<std::string>* warnings);

}  // namespace color3d
