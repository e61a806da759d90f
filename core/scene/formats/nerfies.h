// Reads scenes in the layout of Nerfies and HyperNeRF. For core/scene only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// Returns true if the folder has metadata.json, camera/ and rgb/.
bool IsNerfiesFolder(const std::filesystem::path& folder);

// Reads metadata.json, which lists the frames: "time_id" (else "warp_id") is the time step at 25
// steps a second, "camera_id" the camera. camera/NAME.json is the camera, rgb/2x/NAME.png (else 1x,
// 4x, 8x) the picture, and the optional points.npy has N x 3 points. Scale and centre in scene.json
// are ignored: cameras and points share a frame without them. `warnings` (may be null) receives the
// frames left out because their picture is missing, `cameras` (may be null) the camera names by
// Moment::shot. Throws Error{kInvalidArgument} that names the file if a file is missing or not
// JSON, a field is missing or not finite, a camera is too far away, there are fewer than two
// frames, or points are malformed; and as AssignMoments.
Scene ReadNerfies(const std::filesystem::path& scene_folder,
                  std::vector<std::string>* warnings = nullptr,
                  std::vector<std::string>* cameras = nullptr);

}  // namespace color3d
