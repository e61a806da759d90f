// Camera of one frame in a transforms.json of NeRF, Nerfstudio or Blender. For this folder only.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "core/scene/scene.h"

namespace color3d {

// Fields of one frame. A field missing from the frame is taken from the top of the file. Throws
// Error{kInvalidArgument} that names the place and the field.
class FrameFields {
 public:
  // `place`: e.g. "cameras.json: frame 3". Both JSON objects must outlive this.
  FrameFields(const nlohmann::json& root, const nlohmann::json& frame, std::string place);

  const std::string& place() const { return place_; }
  std::optional<double> Number(const char* key) const;
  double NumberOr(const char* key, double absent) const { return Number(key).value_or(absent); }
  std::string TextOr(const char* key, const std::string& absent) const;
  bool IsTrue(const char* key) const;
  // Returns null if there is none.
  const nlohmann::json* Find(const char* key) const;

 private:
  const nlohmann::json& root_;
  const nlohmann::json& frame_;
  std::string place_;
};

// Parses the whole file. Throws unless it is an object with a list "frames".
nlohmann::json ParseFrames(std::string_view text, const std::string& file_name);

// Reads w, h, fl_x, fl_y, cx, cy, camera_angle_x, camera_angle_y. `width`, `height`: defaults for w
// and h.
Camera ReadIntrinsics(const FrameFields& fields, int width, int height);

// Reads transform_matrix: OpenGL camera-to-world (x right, y up, z backward). It may be scaled.
Pose ReadTransform(const FrameFields& fields);

// Reads intrinsics, pose and lens distortion (camera_model, k1 to k6, p1, p2) into the captured
// camera of a view, calibrated at any size. `width`, `height`: as above.
void ReadFrameCamera(const FrameFields& fields, int width, int height, View* view);

}  // namespace color3d
