// Fuzz target: transforms.json as checked by the server, as read by a worker, and as cameras of a
// render.
#include <cmath>
#include <string_view>

#include "core/scene/formats/camera_file.h"
#include "core/scene/formats/transforms_frame.h"
#include "server/rpc/scenes/transforms_outline.h"
#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace color3d;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const TransformsOutline outline = OutlineOfTransforms(text);
  ReadOrRefuse([&] {
    const Camera absent{640, 480, 500.0, 500.0, 320.0, 240.0};
    for (const FileCamera& camera : ReadCameraFile(text, "cameras.json", Scene(), absent, 100)) {
      if (!camera.cam_from_world.Center().allFinite()) std::abort();
      if (camera.camera.width < 1 || camera.camera.height < 1) std::abort();
    }
  });
  return ReadOrRefuse([&] {
    const nlohmann::json root = ParseFrames(text, "transforms.json");
    // The server accepts everything that a worker accepts.
    if (!outline.is_object) std::abort();
    for (const nlohmann::json& frame : root["frames"]) {
      if (outline.frames == 0) std::abort();
      const FrameFields fields(root, frame, "transforms.json: a frame");
      View view;
      ReadFrameCamera(fields, 640, 480, &view);
      const Pose pose = ReadTransform(fields);
      if (!pose.Center().allFinite()) std::abort();
    }
  });
}

namespace color3d {

std::vector<std::string> FuzzSeeds() {
  const std::string pose = "[[1,0,0,0.5],[0,1,0,-2],[0,0,1,3],[0,0,0,1]]";
  return {R"({"fl_x": 500, "w": 640, "h": 480, "frames": [{"file_path": "a.jpg", )"
          R"("transform_matrix": )" +
              pose + "}]}",
          R"({"camera_angle_x": 0.7, "k1": 0.01, "camera_model": "OPENCV", "frames": [)"
          R"({"file_path": "a", "time": 0.5, "camera": "c", "transform_matrix": )" +
              pose + R"(}, {"fl_x": 1e3, "cx": 3, "cy": 4, "transform_matrix": [[2,0,0,1]]}]})",
          "\xef\xbb\xbf"
          R"({"fl_x": 500, "aabb": [NaN, -Infinity, 1e999,], "frames": [)"
          R"({"file_path": "images\\a.jpg", "transform_matrix": )" +
              pose + ",},],}",
          R"({"frames": []})",
          R"({"a": {"frames": [1]}, "frames": 7})",
          std::string(2000, '['),
          "{\"frames\":" + std::string(2000, '[')};
}

}  // namespace color3d
