// Writers of the formats that core/scene/formats reads, for round trips and synthetic captures.
#pragma once

#include <filesystem>

#include "core/scene/scene.h"

namespace color3d {

// cameras.txt, images.txt and points3D.txt.
void WriteColmapText(const Scene& scene, const std::filesystem::path& model_folder);
// With "time" (s) and "camera" ("cam00") of views that have a moment.
void WriteTransformsJson(const Scene& scene, const std::filesystem::path& json_file);

}  // namespace color3d
