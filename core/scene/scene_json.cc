#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/scene/scene.h"

namespace color3d {
namespace {

using nlohmann::json;

constexpr const char* kFormat = "color3d.scene";
constexpr int kVersion = 1;

json Vector3ToJson(const Eigen::Vector3d& v) { return json::array({v.x(), v.y(), v.z()}); }

json CameraToJson(const Camera& c) {
  return {{"width", c.width},
          {"height", c.height},
          {"fx", c.fx},
          {"fy", c.fy},
          {"cx", c.cx},
          {"cy", c.cy}};
}

const char* ModelName(Distortion::Model model) {
  switch (model) {
    case Distortion::Model::kNone:
      return "none";
    case Distortion::Model::kBrown:
      return "brown";
    case Distortion::Model::kFisheye:
      return "fisheye";
  }
  return "none";
}

// Reads fields; errors name the place ("views[3].camera.fx").
class Field {
 public:
  Field(const json& value, std::string place) : value_(value), place_(std::move(place)) {}

  Error Wrong(const std::string& wanted) const {
    return InvalidArgument("scene: {} must be {}", place_, wanted);
  }
  Field operator[](const char* key) const {
    if (!value_.is_object()) throw Wrong("an object");
    const auto it = value_.find(key);
    const std::string place = place_.empty() ? key : place_ + "." + key;
    if (it == value_.end()) throw InvalidArgument("scene: {} is missing", place);
    return Field(*it, place);
  }
  bool Has(const char* key) const { return value_.is_object() && value_.contains(key); }
  Field operator[](size_t index) const {
    return Field(value_.at(index), fmt::format("{}[{}]", place_, index));
  }
  size_t ArraySize() const {
    if (!value_.is_array()) throw Wrong("a list");
    return value_.size();
  }
  double Number() const {
    if (!value_.is_number()) throw Wrong("a number");
    const double v = value_.get<double>();
    if (!std::isfinite(v)) throw Wrong("finite");
    return v;
  }
  double PositiveNumber() const {
    const double v = Number();
    if (!(v > 0.0)) throw Wrong("positive");
    return v;
  }
  int Integer(int low, int high) const {
    if (!value_.is_number_integer()) throw Wrong("a whole number");
    // Values above the range of int64 are read as unsigned.
    if (value_.is_number_unsigned() && value_.get<uint64_t>() > uint64_t{INT32_MAX}) {
      throw Wrong(fmt::format("at most {}", high));
    }
    const int64_t v = value_.get<int64_t>();
    if (v < low || v > high) {
      throw Wrong(fmt::format("{}..{}, not {}", low, high, v));
    }
    return static_cast<int>(v);
  }
  bool Boolean() const {
    if (!value_.is_boolean()) throw Wrong("true or false");
    return value_.get<bool>();
  }
  std::string Text() const {
    if (!value_.is_string()) throw Wrong("a text");
    return value_.get<std::string>();
  }
  std::string RelativePath() const {
    const std::string path = Text();
    if (!IsSafeRelativePath(path)) throw Wrong("a relative path without '..'");
    return path;
  }
  Eigen::Vector3d Vector3() const {
    if (ArraySize() != 3) throw Wrong("3 numbers");
    return {(*this)[size_t{0}].Number(), (*this)[1].Number(), (*this)[2].Number()};
  }

 private:
  const json& value_;
  std::string place_;
};

Camera CameraFromJson(const Field& field) {
  constexpr int kMaxSidePx = 1'000'000;
  return {field["width"].Integer(1, kMaxSidePx),
          field["height"].Integer(1, kMaxSidePx),
          field["fx"].PositiveNumber(),
          field["fy"].PositiveNumber(),
          field["cx"].Number(),
          field["cy"].Number()};
}

Distortion DistortionFromJson(const Field& field) {
  Distortion distortion;
  const std::string model = field["model"].Text();
  if (model == "brown") {
    distortion.model = Distortion::Model::kBrown;
  } else if (model == "fisheye") {
    distortion.model = Distortion::Model::kFisheye;
  } else if (model != "none") {
    throw field["model"].Wrong("none, brown or fisheye");
  }
  const Field k = field["k"];
  if (k.ArraySize() != distortion.k.size()) throw k.Wrong("8 numbers");
  for (size_t i = 0; i < distortion.k.size(); ++i) distortion.k[i] = k[i].Number();
  return distortion;
}

Pose PoseFromJson(const Field& field) {
  const Field q = field["rotation_wxyz"];
  if (q.ArraySize() != 4) throw q.Wrong("4 numbers");
  Pose pose;
  pose.rotation =
      Eigen::Quaterniond(q[size_t{0}].Number(), q[1].Number(), q[2].Number(), q[3].Number());
  if (std::abs(pose.rotation.norm() - 1.0) > 1e-6) throw q.Wrong("a unit quaternion");
  pose.translation = field["translation"].Vector3();
  return pose;
}

Moment MomentFromJson(const Field& field) {
  const double time_s = field["time_s"].Number();
  if (time_s < 0.0) throw field["time_s"].Wrong("0 or more");
  return {time_s, field["shot"].Integer(0, INT32_MAX)};
}

View ViewFromJson(const Field& field) {
  View view;
  view.name = field["name"].RelativePath();
  view.image_file = field["image_file"].RelativePath();
  if (field.Has("mask_file")) view.mask_file = field["mask_file"].RelativePath();
  view.camera = CameraFromJson(field["camera"]);
  view.captured_camera = CameraFromJson(field["captured_camera"]);
  view.distortion = DistortionFromJson(field["distortion"]);
  view.cam_from_world = PoseFromJson(field["cam_from_world"]);
  view.held_out = field["held_out"].Boolean();
  if (field.Has("moment")) view.moment = MomentFromJson(field["moment"]);
  return view;
}

Relief ReliefFromJson(const Field& field) {
  const Relief relief{
      field["horizon"].Number(), field["foot"].Number(), field["backdrop_depth"].PositiveNumber()};
  if (!(relief.horizon < relief.foot)) throw field["horizon"].Wrong("less than relief.foot");
  return relief;
}

// As [x, y, z, error, [views]], which is compact: a scene may have a million points.
SparsePoint PointFromJson(const Field& field, int view_count) {
  if (field.ArraySize() != 5) throw field.Wrong("[x, y, z, error, [views]]");
  SparsePoint point;
  point.position = {field[size_t{0}].Number(), field[1].Number(), field[2].Number()};
  point.reprojection_error_px = field[3].Number();
  const Field views = field[4];
  const size_t count = views.ArraySize();
  point.views.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    point.views.push_back(views[i].Integer(0, view_count - 1));
    if (i > 0 && point.views[i] <= point.views[i - 1]) throw views.Wrong("ascending");
  }
  return point;
}

json ViewsToJson(const std::vector<View>& views) {
  json array = json::array();
  for (const View& view : views) {
    const Eigen::Quaterniond& q = view.cam_from_world.rotation;
    array.push_back(
        {{"name", view.name},
         {"image_file", view.image_file},
         {"camera", CameraToJson(view.camera)},
         {"captured_camera", CameraToJson(view.captured_camera)},
         {"distortion", {{"model", ModelName(view.distortion.model)}, {"k", view.distortion.k}}},
         {"cam_from_world",
          {{"rotation_wxyz", json::array({q.w(), q.x(), q.y(), q.z()})},
           {"translation", Vector3ToJson(view.cam_from_world.translation)}}},
         {"held_out", view.held_out}});
    if (view.moment) {
      array.back()["moment"] = {{"time_s", view.moment->time_s}, {"shot", view.moment->shot}};
    }
    if (!view.mask_file.empty()) array.back()["mask_file"] = view.mask_file;
  }
  return array;
}

// Adds the views' names to `names`, which must stay unique.
std::vector<View> ViewsFromJson(const Field& field, std::set<std::string>* names) {
  std::vector<View> views;
  const size_t count = field.ArraySize();
  views.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    views.push_back(ViewFromJson(field[i]));
    if (!names->insert(views.back().name).second) throw field[i]["name"].Wrong("unique");
  }
  return views;
}

}  // namespace

std::string SceneToJson(const Scene& scene) {
  json points = json::array();
  for (const SparsePoint& point : scene.points) {
    points.push_back(json::array({point.position.x(),
                                  point.position.y(),
                                  point.position.z(),
                                  point.reprojection_error_px,
                                  point.views}));
  }
  json root = {{"format", kFormat},
               {"version", kVersion},
               {"kind", scene.capture().name},
               {"world_from_scene_scale", scene.world_from_scene_scale},
               {"world_offset", Vector3ToJson(scene.world_offset)},
               {"views", ViewsToJson(scene.views)},
               {"points", std::move(points)}};
  if (!scene.unplaced.empty()) root["unplaced"] = ViewsToJson(scene.unplaced);
  if (scene.relief) {
    root["relief"] = {{"horizon", scene.relief->horizon},
                      {"foot", scene.relief->foot},
                      {"backdrop_depth", scene.relief->backdrop_depth}};
  }
  try {
    return root.dump();
  } catch (const json::exception& e) {  // a name that is not UTF-8
    throw InvalidArgument(std::string("scene cannot be written as JSON: ") + e.what());
  }
}

Scene SceneFromJson(std::string_view text) {
  json root;
  try {
    root = json::parse(text);
  } catch (const json::exception& e) {
    throw InvalidArgument(std::string("scene: not JSON: ") + e.what());
  }
  const Field field(root, "");
  if (!root.is_object()) throw InvalidArgument("scene: must be a JSON object");
  if (field["format"].Text() != kFormat) throw field["format"].Wrong(kFormat);
  if (field["version"].Integer(1, INT32_MAX) != kVersion) {
    throw field["version"].Wrong(fmt::format("{}; update color3d to read it", kVersion));
  }
  Scene scene;
  if (root.contains("world_from_scene_scale")) {  // absent from older files
    scene.world_from_scene_scale = field["world_from_scene_scale"].PositiveNumber();
  }
  scene.world_offset = field["world_offset"].Vector3();
  if (field.Has("relief")) scene.relief = ReliefFromJson(field["relief"]);
  std::set<std::string> names;
  scene.views = ViewsFromJson(field["views"], &names);
  if (field.Has("unplaced")) scene.unplaced = ViewsFromJson(field["unplaced"], &names);
  const Field points = field["points"];
  const size_t point_count = points.ArraySize();
  scene.points.reserve(point_count);
  for (size_t i = 0; i < point_count; ++i) {
    scene.points.push_back(PointFromJson(points[i], static_cast<int>(scene.views.size())));
  }
  if (field.Has("kind")) {  // absent from older files
    const CaptureKind kind = KindOfName(field["kind"].Text());
    scene.are_pictures = kind == CaptureKind::kPictures && !scene.HasTimes();
    if (kind != scene.kind()) throw field["kind"].Wrong(scene.capture().name);
  }
  return scene;
}

}  // namespace color3d
