#include "core/scene/formats/transforms_frame.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/base/text/json_text.h"
#include "core/scene/formats/within_reach.h"

namespace color3d {
namespace {

using nlohmann::json;

int ReadSide(const FrameFields& fields, const char* key, int absent) {
  const double side = fields.NumberOr(key, absent);
  if (!(side >= 1.0 && side <= 1e6)) {
    throw InvalidArgument("{}: {} is {} px", fields.place(), key, side);
  }
  return static_cast<int>(std::lround(side));
}

Distortion ReadDistortion(const FrameFields& fields) {
  const std::string model = fields.TextOr("camera_model", "OPENCV");
  const bool fisheye = model == "OPENCV_FISHEYE" || fields.IsTrue("is_fisheye");
  const bool pinhole = model == "PINHOLE" || model == "SIMPLE_PINHOLE";
  const bool brown =
      model == "OPENCV" || model == "SIMPLE_RADIAL" || model == "RADIAL" || model == "FULL_OPENCV";
  if (!fisheye && !pinhole && !brown) {
    throw InvalidArgument(
        "{}: camera_model {} is not supported; use OPENCV, OPENCV_FISHEYE or PINHOLE",
        fields.place(),
        model);
  }
  Distortion distortion;
  if (pinhole && !fisheye) return distortion;
  if (fisheye) {
    distortion.model = Distortion::Model::kFisheye;
    distortion.k = {fields.NumberOr("k1", 0),
                    fields.NumberOr("k2", 0),
                    fields.NumberOr("k3", 0),
                    fields.NumberOr("k4", 0)};
    return distortion;
  }
  if (model != "FULL_OPENCV" && fields.NumberOr("k4", 0.0) != 0.0) {
    // OpenCV uses k4 in a denominator, Nerfstudio as a fourth power: no value is better than a
    // wrong one.
    throw InvalidArgument("{}: k4 is not supported for camera_model {}", fields.place(), model);
  }
  distortion.k = {fields.NumberOr("k1", 0),
                  fields.NumberOr("k2", 0),
                  fields.NumberOr("p1", 0),
                  fields.NumberOr("p2", 0),
                  fields.NumberOr("k3", 0),
                  fields.NumberOr("k4", 0),
                  fields.NumberOr("k5", 0),
                  fields.NumberOr("k6", 0)};
  const bool any = std::ranges::any_of(distortion.k, [](double k) { return k != 0.0; });
  if (any) distortion.model = Distortion::Model::kBrown;
  return distortion;
}

}  // namespace

FrameFields::FrameFields(const json& root, const json& frame, std::string place)
    : root_(root), frame_(frame), place_(std::move(place)) {}

std::optional<double> FrameFields::Number(const char* key) const {
  const json* value = Find(key);
  if (value == nullptr) return std::nullopt;
  if (!value->is_number() || !std::isfinite(value->get<double>())) {
    throw InvalidArgument("{}: {} must be a finite number", place_, key);
  }
  return value->get<double>();
}

std::string FrameFields::TextOr(const char* key, const std::string& absent) const {
  const json* value = Find(key);
  if (value == nullptr) return absent;
  if (!value->is_string()) throw InvalidArgument("{}: {} must be a text", place_, key);
  return value->get<std::string>();
}

bool FrameFields::IsTrue(const char* key) const {
  const json* value = Find(key);
  return value != nullptr && value->is_boolean() && value->get<bool>();
}

const json* FrameFields::Find(const char* key) const {
  for (const json* object : {&frame_, &root_}) {
    const auto it = object->find(key);
    if (it != object->end() && !it->is_null()) return &*it;
  }
  return nullptr;
}

json ParseFrames(std::string_view text, const std::string& file_name) {
  json root = ParseJson(text, file_name);
  if (!root.is_object() || !root.contains("frames") || !root["frames"].is_array()) {
    throw InvalidArgument("{} has no list of frames", file_name);
  }
  return root;
}

Camera ReadIntrinsics(const FrameFields& fields, int width, int height) {
  Camera camera;
  camera.width = ReadSide(fields, "w", width);
  camera.height = ReadSide(fields, "h", height);
  const auto from_angle = [&](const char* key, int side) -> std::optional<double> {
    const std::optional<double> angle = fields.Number(key);
    if (!angle) return std::nullopt;
    return 0.5 * side / std::tan(0.5 * *angle);
  };
  std::optional<double> fx = fields.Number("fl_x");
  std::optional<double> fy = fields.Number("fl_y");
  if (!fx) fx = from_angle("camera_angle_x", camera.width);
  if (!fy) fy = from_angle("camera_angle_y", camera.height);
  if (!fx) fx = fy;
  if (!fx) {
    throw InvalidArgument("{}: fl_x or camera_angle_x is missing", fields.place());
  }
  camera.fx = *fx;
  camera.fy = fy.value_or(*fx);  // square pixels unless given
  camera.cx = fields.NumberOr("cx", 0.5 * camera.width);
  camera.cy = fields.NumberOr("cy", 0.5 * camera.height);
  if (!(camera.fx > 0.0 && camera.fy > 0.0 && camera.fx < 1e9 && camera.fy < 1e9)) {
    throw InvalidArgument("{}: the focal length is {} x {} px; it must be positive",
                          fields.place(),
                          camera.fx,
                          camera.fy);
  }
  return camera;
}

Pose ReadTransform(const FrameFields& fields) {
  const json* rows = fields.Find("transform_matrix");
  if (rows == nullptr || !rows->is_array() || (rows->size() != 4 && rows->size() != 3)) {
    throw InvalidArgument("{}: transform_matrix must have 4 rows", fields.place());
  }
  Eigen::Matrix<double, 3, 4> m;
  for (int r = 0; r < 3; ++r) {
    const json& row = (*rows)[r];
    if (!row.is_array() || row.size() != 4) {
      throw InvalidArgument("{}: transform_matrix must have 4 columns", fields.place());
    }
    for (int c = 0; c < 4; ++c) {
      if (!row[c].is_number() || !std::isfinite(row[c].get<double>())) {
        throw InvalidArgument(
            "{}: transform_matrix has an element that is not a finite number; correct the frame or "
            "remove it",
            fields.place());
      }
      m(r, c) = row[c].get<double>();
    }
  }
  const Eigen::Matrix3d axes = m.leftCols<3>();
  const double scale = std::cbrt(axes.determinant());
  if (!(scale > 1e-9) ||
      !(axes.transpose() * axes / (scale * scale)).isApprox(Eigen::Matrix3d::Identity(), 1e-2)) {
    throw InvalidArgument("{}: transform_matrix is not a rotation (determinant {})",
                          fields.place(),
                          axes.determinant());
  }
  CheckPositionRange(m.col(3), fields.place());
  // Nearest rotation, then y and z reversed.
  const Eigen::Matrix3d world_from_cam =
      NearestRotation(axes) * Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  Pose pose;
  pose.rotation = Eigen::Quaterniond(Eigen::Matrix3d(world_from_cam.transpose())).normalized();
  pose.translation = -(pose.rotation * m.col(3));
  return pose;
}

void ReadFrameCamera(const FrameFields& fields, int width, int height, View* view) {
  view->captured_camera = ReadIntrinsics(fields, width, height);
  view->distortion = ReadDistortion(fields);
  view->cam_from_world = ReadTransform(fields);
}

}  // namespace color3d
