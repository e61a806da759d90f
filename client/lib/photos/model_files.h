// Files beside a user's photos with poses, times and points, and the folders of photos that they
// name. Reads names, and the contents of transforms.json; never writes. Pure functions of the file
// system, thread-safe.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "client/lib/photos/photo_folder.h"

namespace color3d::client {

// Returns true for the layout of Nerfies and HyperNeRF: metadata.json, camera/ and rgb/.
bool IsNerfiesFolder(const std::filesystem::path& root);
// Adds its files other than pictures.
void AddNerfiesFiles(const std::filesystem::path& root, std::vector<LocalFile>* files);

// Returns the folders below `root` that transforms.json, or Blender's transforms_train.json and the
// like, names. Empty without such a file. Throws Error{kInvalidArgument} that names a file that is
// not JSON or has no frames.
std::set<std::string> FoldersInTransforms(const std::filesystem::path& root);

// Returns the folder that becomes images/ of the scene: `images`, ignoring case; empty if there is
// none.
std::string ImagesFolder(const std::filesystem::path& root);
// Returns true if files in `root` have poses.
bool HasPoses(const std::filesystem::path& root);
// Returns the file or folder with poses in `root`, the parent of the user's folder of photos; empty
// if there is none.
std::string FindSiblingPoses(const std::filesystem::path& root);
// Returns the only folder in `root` that directly contains photos; empty if there is none, or more
// than one.
std::string FindSinglePhotoFolder(const std::filesystem::path& root);

// Adds the files that belong to the photos or films in `folder`: COLMAP models (those of
// catalogue/pose_files.h) and times.txt, transforms.json or the like with its file of points,
// poses_bounds.npy; and notes on poses that are not used.
void CollectModelFiles(const std::filesystem::path& root, PhotoFolder* folder);

}  // namespace color3d::client
