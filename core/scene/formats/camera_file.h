// Cameras that the user has made elsewhere, to render a scene from. Stateless.
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

// A transforms.json, as Nerfstudio, NeRF and exporters of Blender write it: a list "frames" with a
// transform_matrix each (camera to world, OpenGL axes) in the frame and units of the model that the
// user gave or that the exported files have; w, h, fl_x, fl_y, cx, cy or camera_angle_x, for all or
// for each. Each may have the `time` at which it sees a scene that moves: seconds from the scene's
// first moment. Photos and lens distortion that it names do not matter. What it does not say of the
// picture is as in `absent`. Throws Error{kInvalidArgument} that names the file, the frame and the
// field: no JSON, no frames or more than `max_frames`, a matrix that is no pose, numbers that are
// not finite.
std::vector<FileCamera> ReadCameraFile(std::string_view text,
                                       const std::string& file_name,
                                       const Scene& scene,
                                       const Camera& absent,
                                       size_t max_frames);

}  // namespace color3d
