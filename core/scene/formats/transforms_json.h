// transforms.json reader with its warnings, behind ReadTransformsJson. For this folder only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// As ReadTransformsJson; says in `warnings` what was left out.
Scene LoadTransformsJson(const std::filesystem::path& json_file,
                         const std::filesystem::path& scene_folder,
                         std::vector<std::string>* warnings);

}  // namespace color3d
