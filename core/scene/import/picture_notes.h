// Notes for the user on how photos are read. For this folder only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/scene/scene.h"

namespace color3d {

// Returns the PictureNotes (codec.h) of the photos of the views, equal ones merged: "a.tif has 2
// pages; the largest is read (200 x 133 px); the same of 13 more photos". Reads at most 500 views,
// evenly spread.
std::vector<std::string> CollectPictureNotes(const std::filesystem::path& scene_folder,
                                             const std::vector<View>& views,
                                             const CancellationToken& cancel);

}  // namespace color3d
