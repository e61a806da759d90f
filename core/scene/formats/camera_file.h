// Reads files of cameras that other programs wrote, to render a scene from them. Stateless.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

struct FileCamera {
  Camera camera;
  Pose cam_from_world;  // in the scene's own units, as those of its views
  std::optional<double> time_s;
};

// Reads a transforms.json as Nerfstudio, NeRF and Blender exporters write it: a list "frames", each
// with a transform_matrix (camera to world, OpenGL axes) in the frame and units of the user's model
// and of the exported files; and w, h, fl_x, fl_y, cx, cy or camera_angle_x, for all frames or for
// each. In dynamic scenes a frame may have a `time`: seconds from the scene's first moment. Photos
// and lens distortion are ignored. Missing intrinsics are taken from `absent`. Throws
// Error{kInvalidArgument} that names the file, the frame and the field if the text is not JSON, has
// no frames or more than `max_frames`, a matrix is no pose, or a number is not finite.
std::vector<FileCamera> ReadCameraFile(std::string_view text,
                                       const std::string& file_name,
                                       const Scene& scene,
                                       const Camera& absent,
                                       size_t max_frames);

}  // namespace color3d
