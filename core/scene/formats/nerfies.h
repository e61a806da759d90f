// Scenes as Nerfies and HyperNeRF have them. For core/scene only.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// True when the folder has metadata.json, camera/ and rgb/.
bool IsNerfiesFolder(const std::filesystem::path& folder);

// metadata.json names the frames: "time_id" (else "warp_id") is the number of the time step, of
// which 25 make a second, "camera_id" the camera; camera/NAME.json has the camera, rgb/2x/NAME.png
// (else 1x, 4x, 8x) the picture, points.npy, where there is one, N x 3 points. scene.json's scale
// and centre do not matter: cameras and points share a frame without them. `warnings` (may be null)
// receives which frames were left out because their picture does not exist, `cameras` (may be null)
// the names of the cameras by Moment::shot. Throws Error{kInvalidArgument} that names the file: no
// such file, no JSON, a field that is missing or not finite, a camera too far away, fewer than two
// frames, points that are none, and what MomentsOf refuses.
Scene ReadNerfies(const std::filesystem::path& scene_folder,
                  std::vector<std::string>* warnings = nullptr,
                  std::vector<std::string>* cameras = nullptr);

}  // namespace color3d
