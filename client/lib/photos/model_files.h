// The files beside a user's photos that tell poses, times and points, and where photos lie that
// they name. Reads names, and of transforms.json what it names; never writes. Pure functions of the
// file system, thread-safe.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "client/lib/photos/photo_folder.h"

namespace color3d::client {

// True for a folder as Nerfies and HyperNeRF have it: metadata.json, camera/ and rgb/.
bool IsNerfiesFolder(const std::filesystem::path& root);
// Its files other than pictures.
void AddNerfiesFiles(const std::filesystem::path& root, std::vector<LocalFile>* files);

// Folders below `root` that transforms.json, or Blender's transforms_train.json and its like, name.
// Empty without such a file. Throws Error{kInvalidArgument} that names a file that is not JSON or
// has no frames.
std::set<std::string> FoldersThatTransformsNames(const std::filesystem::path& root);

// The folder of photos that is images/ of the scene: images in any case of letters; empty where
// there is none.
std::string ImagesFolder(const std::filesystem::path& root);
// Whether files in `root` tell poses.
bool HasPoses(const std::filesystem::path& root);
// The file or folder in `root`, which holds the folder of photos that the user gave, that tells
// poses; empty where there is none.
std::string PosesBeside(const std::filesystem::path& root);
// The only folder in `root` with photos of its own; empty where there are none or several.
std::string OnlyFolderOfPhotos(const std::filesystem::path& root);

// Adds what belongs to the photos or films in `folder`: COLMAP models (catalogue/pose_files.h says
// which) and times.txt, transforms.json or its like with the file of points that it names,
// poses_bounds.npy; and notes of poses that are not used.
void CollectModelFiles(const std::filesystem::path& root, PhotoFolder* folder);

}  // namespace color3d::client
