// Posed scenes in the formats of other programs. Every photo that a model names is looked for below
// `scene_folder`; the returned views have `image_file` relative to it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// A COLMAP model, text or binary; with a times.txt in the scene's folder (colmap_model.h) the views
// have moments (frame_times.h). Lines for photos that the model has not placed say nothing.
// `warnings` (may be null) receives what is wrong with cameras whose intrinsics do not fit their
// observations, and that times.txt names no photo of the model; `cameras` (may be null) the names
// of the cameras by Moment::shot. Throws Error{kInvalidArgument} naming the file and the place in
// it, or photos that have no line where others have one; and what MomentsOf refuses.
Scene ReadColmapModel(const std::filesystem::path& model_folder,
                      const std::filesystem::path& scene_folder,
                      std::vector<std::string>* warnings = nullptr,
                      std::vector<std::string>* cameras = nullptr);

// The transforms.json of NeRF and Nerfstudio; with a `time` (and perhaps a `camera`) in every
// frame, as in D-NeRF, the views have moments (frame_times.h). `warnings` (may be null) receives
// which frames were left out because their photo does not exist, `cameras` (may be null) the names
// of the cameras by Moment::shot. Throws as ReadColmapModel.
Scene ReadTransformsJson(const std::filesystem::path& json_file,
                         const std::filesystem::path& scene_folder,
                         std::vector<std::string>* warnings = nullptr,
                         std::vector<std::string>* cameras = nullptr);

}  // namespace color3d
