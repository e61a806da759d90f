// Adds masks from a folder of their own.
#pragma once

#include <filesystem>

#include "client/lib/photos/photo_folder.h"

namespace color3d::client {

// Adds the masks in `masks` (any depth) to the folder's files, as masks/ of the scene, and a note
// with their number. The mask of images/a.jpg is a.png or a.jpg.png. Photos without a mask are used
// whole. Masks without a photo are left out, with a note. Throws Error if there is no such folder,
// no mask belongs to a photo, a mask is no PNG, a photo has two masks, a mask differs in size from
// its photo (with both sizes), or there are too many files.
void AddMasks(const std::filesystem::path& masks, PhotoFolder* folder);

}  // namespace color3d::client
