// The files beside a user's photos that tell poses, times and points. Reads names, and of
// transforms.json which folders it names; never writes. Pure functions of the file system,
// thread-safe.
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

// Folders below `root` that transforms.json names. Empty without such a file. Throws
// Error{kInvalidArgument} that names a file that is not JSON or has no frames.
std::set<std::string> FoldersThatTransformsNames(const std::filesystem::path& root);

// Adds what belongs to the photos or films in `folder`: a COLMAP model and times.txt,
// transforms.json or poses_bounds.npy, and notes of what is left out.
void CollectModelFiles(const std::filesystem::path& root, PhotoFolder* folder);

}  // namespace color3d::client
