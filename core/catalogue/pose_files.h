// Which of a scene's files tell poses: one list for the client that sends them, the server that
// checks them and the import that reads them. Pure functions of names, thread-safe.
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

// The COLMAP models among a scene's files, which are paths relative to its folder: those that are
// whole, in the places where programs put them (sparse, sparse/0, sparse/1, colmap/sparse/0, the
// folder itself, ...); where there is none, whole ones in other folders; else what there is of
// some. The most usual place comes first. In augment/, masks/ and frames/ there is none.
std::vector<ColmapPlace> ColmapPlaces(const std::vector<std::string>& files);

inline constexpr std::string_view kTransformsFile = "transforms.json";
// Of Blender, as NeRF's synthetic scenes and D-NeRF have it: read together, without a
// transforms.json.
inline constexpr std::string_view kBlenderFiles[] = {
    "transforms_train.json", "transforms_val.json", "transforms_test.json"};
inline constexpr std::string_view kPosesBoundsFile = "poses_bounds.npy";
// Sparse points beside poses that name no file of points.
inline constexpr std::string_view kPointFiles[] = {"sparse_pc.ply", "points3d.ply", "points3D.ply"};

// True for a transforms.json, or one of Blender's, in any folder.
bool IsTransformsFile(std::string_view path);

}  // namespace color3d
