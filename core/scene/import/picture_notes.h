// What users want to know of how their photos are read. For this folder only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/scene/scene.h"

namespace color3d {

// PictureNotes (codec.h) of the views' photos, equal ones told once: "a.tif has 2 pages; the
// largest is read (200 x 133 px); the same of 13 more photos". Of many views 500, evenly spread,
// are looked at.
std::vector<std::string> NotesOnPictures(const std::filesystem::path& scene_folder,
                                         const std::vector<View>& views,
                                         const CancellationToken& cancel);

}  // namespace color3d
