// Masks of photos, from a folder of their own.
#pragma once

#include <filesystem>

#include "client/lib/photos/photo_folder.h"

namespace color3d::client {

// Adds the masks in `masks` (any depth) to the folder's files, as masks/ of the scene: for
// images/a.jpg the file a.png or a.jpg.png, and a note of how many. Photos without one count as a
// whole. Masks of no photo are left out, with a note. Throws Error: no such folder, no mask of a
// photo in it, a mask that is no PNG, two masks of one photo, a mask of another size than its photo
// (with both sizes), too many files.
void AddMasks(const std::filesystem::path& masks, PhotoFolder* folder);

}  // namespace color3d::client
