// Files with poses in a scene: one list for the client, which sends them, the server, which checks
// them, and import, which reads them. Pure functions of names, thread-safe.
#pragma once

#include <iterator>
#include <string>
#include <string_view>
#include <vector>

namespace color3d {

// A folder with files of a COLMAP model.
struct ColmapPlace {
  std::string folder;              // relative to the scene's folder; empty: that folder itself
  std::vector<std::string> files;  // of one kind, .bin or .txt, where that kind is whole, else all
  bool whole = false;              // cameras, images and points3D of one kind are there
};

// Returns the COLMAP models among a scene's files (paths relative to its folder): complete models
// in the usual places (sparse, sparse/0, sparse/1, colmap/sparse/0, the folder itself, ...); if
// there are none, complete models in other folders; else incomplete ones. The most usual place
// comes first. Ignores augment/, masks/ and frames/.
std::vector<ColmapPlace> ColmapPlaces(const std::vector<std::string>& files);

inline constexpr std::string_view kTransformsFile = "transforms.json";
// Blender's, as in NeRF's synthetic scenes and in D-NeRF: merged if there is no transforms.json.
inline constexpr std::string_view kBlenderFiles[] = {
    "transforms_train.json", "transforms_val.json", "transforms_test.json"};
inline constexpr std::string_view kPosesBoundsFile = "poses_bounds.npy";
// Sparse points beside poses that name no file of points.
inline constexpr std::string_view kPointFiles[] = {"sparse_pc.ply", "points3d.ply", "points3D.ply"};

// True for a transforms.json, or one of Blender's, in any folder.
bool IsTransformsFile(std::string_view path);

}  // namespace color3d
