#include "core/scene/formats/camera_file.h"

#include <fmt/core.h>

#include "core/base/error.h"
#include "core/scene/formats/transforms_frame.h"

namespace color3d {
namespace {

constexpr double kFarthest = 1e9;  // distance of a camera from the origin, scene units
constexpr int kLargestSide = 1'000'000;

// Keeps the vertical field of view if the size differs.
Camera WithSize(const Camera& camera, int width, int height) {
  const double scale = static_cast<double>(height) / camera.height;
  return {width, height, scale * camera.fx, scale * camera.fy, 0.5 * width, 0.5 * height};
}

Camera ReadCamera(const FrameFields& fields, const Camera& absent) {
  for (const char* key : {"fl_x", "fl_y", "camera_angle_x", "camera_angle_y"}) {
    if (fields.Find(key) != nullptr) return ReadIntrinsics(fields, absent.width, absent.height);
  }
  const double width = fields.NumberOr("w", absent.width);
  const double height = fields.NumberOr("h", absent.height);
  if (!(width >= 1.0 && height >= 1.0 && width <= kLargestSide && height <= kLargestSide)) {
    throw InvalidArgument("{}: the picture is {} x {} px", fields.place(), width, height);
  }
  return WithSize(absent, static_cast<int>(width), static_cast<int>(height));
}

}  // namespace

std::vector<FileCamera> ReadCameraFile(std::string_view text,
                                       const std::string& file_name,
                                       const Scene& scene,
                                       const Camera& absent,
                                       size_t max_frames) {
  const nlohmann::json root = ParseFrames(text, file_name);
  const nlohmann::json& frames = root["frames"];
  if (frames.empty()) throw InvalidArgument("{} has an empty list of frames", file_name);
  if (frames.size() > max_frames) {
    throw InvalidArgument(
        "{} has {} frames; at most {} are allowed", file_name, frames.size(), max_frames);
  }
  std::vector<FileCamera> cameras;
  for (size_t i = 0; i < frames.size(); ++i) {
    const std::string place = fmt::format("{}: frame {}", file_name, i);
    if (!frames[i].is_object()) throw InvalidArgument("{} must be an object", place);
    const FrameFields fields(root, frames[i], place);
    FileCamera camera;
    camera.camera = ReadCamera(fields, absent);
    camera.cam_from_world = ReadTransform(fields);
    camera.time_s = FrameFields(frames[i], frames[i], place).Number("time");
    // world = scale * scene + offset, for points as for the camera's centre.
    const Eigen::Vector3d center =
        (camera.cam_from_world.Center() - scene.world_offset) / scene.world_from_scene_scale;
    if (!(center.norm() < kFarthest)) {
      throw InvalidArgument("{}: the camera stands {:g} units away from the scene",
                            place,
                            center.norm() * scene.world_from_scene_scale);
    }
    camera.cam_from_world.translation = -(camera.cam_from_world.rotation * center);
    cameras.push_back(camera);
  }
  return cameras;
}

}  // namespace color3d
