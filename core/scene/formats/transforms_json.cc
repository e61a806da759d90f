#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/scene/formats/scene_readers.h"
#include "core/scene/import.h"
#include "core/scene/photos.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

// Fields of one frame; what a frame does not say, the file says for all.
class FrameFields {
 public:
  FrameFields(const json& root, const json& frame, std::string place)
      : root_(root), frame_(frame), place_(std::move(place)) {}

  const std::string& place() const { return place_; }
  std::optional<double> Number(const char* key) const {
    const json* value = Find(key);
    if (value == nullptr) return std::nullopt;
    if (!value->is_number() || !std::isfinite(value->get<double>())) {
      throw InvalidArgument("{}: {} must be a finite number", place_, key);
    }
    return value->get<double>();
  }
  double NumberOr(const char* key, double absent) const { return Number(key).value_or(absent); }
  std::string TextOr(const char* key, const std::string& absent) const {
    const json* value = Find(key);
    if (value == nullptr) return absent;
    if (!value->is_string()) throw InvalidArgument("{}: {} must be a text", place_, key);
    return value->get<std::string>();
  }
  bool IsTrue(const char* key) const {
    const json* value = Find(key);
    return value != nullptr && value->is_boolean() && value->get<bool>();
  }
  const json* Find(const char* key) const {
    for (const json* object : {&frame_, &root_}) {
      const auto it = object->find(key);
      if (it != object->end() && !it->is_null()) return &*it;
    }
    return nullptr;
  }

 private:
  const json& root_;
  const json& frame_;
  std::string place_;
};

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
    // OpenCV means a denominator by k4, nerfstudio a fourth power: better none than the wrong one.
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
  const bool any =
      std::any_of(distortion.k.begin(), distortion.k.end(), [](double k) { return k != 0.0; });
  if (any) distortion.model = Distortion::Model::kBrown;
  return distortion;
}

int ReadSide(const FrameFields& fields, const char* key, int absent) {
  const double side = fields.NumberOr(key, absent);
  if (!(side >= 1.0 && side <= 1e6)) {
    throw InvalidArgument("{}: {} is {} px", fields.place(), key, side);
  }
  return static_cast<int>(std::lround(side));
}

Camera ReadCamera(const FrameFields& fields, const Photo& photo) {
  Camera camera;
  camera.width = ReadSide(fields, "w", photo.stored_width);
  camera.height = ReadSide(fields, "h", photo.stored_height);
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
  camera.fy = fy.value_or(*fx);  // square pixels unless told otherwise
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

// OpenGL camera-to-world (x right, y up, z backward) to our world-to-camera.
Pose ReadPose(const FrameFields& fields) {
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
        throw InvalidArgument("{}: transform_matrix has an element that is not a finite number",
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
  // The nearest rotation, then y and z reversed.
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(axes, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d world_from_gl = svd.matrixU() * svd.matrixV().transpose();
  const Eigen::Matrix3d world_from_cam =
      world_from_gl * Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  Pose pose;
  pose.rotation = Eigen::Quaterniond(Eigen::Matrix3d(world_from_cam.transpose())).normalized();
  pose.translation = -(pose.rotation * m.col(3));
  return pose;
}

std::string WithoutPrefix(std::string text, const std::string& prefix) {
  while (text.compare(0, prefix.size(), prefix) == 0) text.erase(0, prefix.size());
  return text;
}

json ParseRoot(const fs::path& file) {
  json root;
  try {
    root = json::parse(ReadFile(file));
  } catch (const json::exception& e) {
    throw InvalidArgument("{} is not JSON: {}", file.filename().string(), e.what());
  }
  if (!root.is_object() || !root.contains("frames") || !root["frames"].is_array()) {
    throw InvalidArgument("{} has no list of frames", file.filename().string());
  }
  return root;
}

// False when the frame's photo does not exist.
bool ReadFrame(const FrameFields& fields, const fs::path& scene_folder, View* view) {
  const std::string path = WithoutPrefix(fields.TextOr("file_path", ""), "./");
  if (path.empty()) throw InvalidArgument("{}: file_path is missing", fields.place());
  view->image_file = FindPhotoFile(scene_folder, WithoutPrefix(path, "images/"), true);
  if (view->image_file.empty()) return false;
  view->name = WithoutPrefix(view->image_file, "images/");
  Photo photo{view->name, view->image_file};
  ProbePhoto(scene_folder, &photo);
  view->captured_camera = ReadCamera(fields, photo);
  view->distortion = ReadDistortion(fields);
  view->cam_from_world = ReadPose(fields);
  FitViewToPhoto(photo, view);
  return true;
}

}  // namespace

Scene ReadTransformsJson(const fs::path& json_file,
                         const fs::path& scene_folder,
                         std::vector<std::string>* warnings) {
  const json root = ParseRoot(json_file);
  const std::string file_name = json_file.filename().string();
  Scene scene;
  std::vector<std::string> missing;
  for (size_t i = 0; i < root["frames"].size(); ++i) {
    const json& frame = root["frames"][i];
    const std::string place = fmt::format("{}: frame {}", file_name, i);
    if (!frame.is_object()) throw InvalidArgument("{} must be an object", place);
    const FrameFields fields(root, frame, place);
    View view;
    if (ReadFrame(fields, scene_folder, &view)) {
      scene.views.push_back(std::move(view));
    } else {
      missing.push_back(fields.TextOr("file_path", ""));
    }
  }
  std::sort(scene.views.begin(), scene.views.end(), [](const View& x, const View& y) {
    return x.name < y.name;
  });
  for (size_t i = 1; i < scene.views.size(); ++i) {
    if (scene.views[i].name == scene.views[i - 1].name) {
      throw InvalidArgument("{} names the photo {} twice", file_name, scene.views[i].name);
    }
  }
  if (scene.views.size() < 2) {
    throw InvalidArgument("{} names {} photos, of which {} exist in {}; at least 2 are needed{}",
                          file_name,
                          root["frames"].size(),
                          scene.views.size(),
                          scene_folder.string(),
                          missing.empty() ? "" : fmt::format(" (missing: {}, ...)", missing[0]));
  }
  if (!missing.empty() && warnings != nullptr) {
    warnings->push_back(
        fmt::format("{} of the {} photos that {} names do not exist ({}, ...) and were left out",
                    missing.size(),
                    root["frames"].size(),
                    file_name,
                    missing[0]));
  }
  return scene;
}

}  // namespace color3d
