#include "core/scene/formats/nerfies.h"

#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/base/text/json_text.h"
#include "core/catalogue/film_rate.h"
#include "core/scene/formats/npy.h"
#include "core/scene/formats/transforms_frame.h"
#include "core/scene/formats/within_reach.h"
#include "core/scene/frame_times.h"
#include "core/scene/named_files.h"
#include "core/scene/photos.h"
#include "core/scene/sparse_cloud.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

constexpr char kMetadata[] = "metadata.json";
constexpr char kPoints[] = "points.npy";
constexpr size_t kMaxPoints = 500'000;

json ParseObject(const fs::path& folder, const std::string& file) {
  if (!IsFile(folder / file)) throw InvalidArgument("{} is missing", file);
  json root = ParseJson(ReadFile(folder / file), file);
  if (!root.is_object()) throw InvalidArgument("{} is not a JSON object", file);
  return root;
}

// Flattens nested lists of numbers.
std::vector<double> ReadNumbers(const FrameFields& fields, const char* key, size_t count) {
  const json* list = fields.Find(key);
  std::vector<double> numbers;
  bool good = list != nullptr && list->is_array() && list->size() <= count;
  const auto add = [&](const json& value) {
    good = good && value.is_number() && std::isfinite(value.get<double>());
    if (good) numbers.push_back(value.get<double>());
  };
  if (good) {
    for (const json& entry : *list) {
      if (entry.is_array()) {
        for (const json& value : entry) add(value);
      } else {
        add(entry);
      }
    }
  }
  if (!good || numbers.size() != count) {
    throw InvalidArgument("{}: {} must be {} finite numbers", fields.place(), key, count);
  }
  return numbers;
}

double Positive(const FrameFields& fields, const char* key, double absent) {
  const double value = fields.NumberOr(key, absent);
  if (!(value > 0.0 && value < 1e9)) {
    throw InvalidArgument("{}: {} is {:g}; it must be positive", fields.place(), key, value);
  }
  return value;
}

// OpenCV's axes; orientation: from world to camera.
void ReadCamera(const json& root, const std::string& file, View* view) {
  const FrameFields fields(root, root, file);
  const std::vector<double> r = ReadNumbers(fields, "orientation", 9);
  const Eigen::Matrix3d axes =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(r.data());
  if (!(std::abs(axes.determinant() - 1.0) < 1e-2) ||
      !(axes * axes.transpose()).isApprox(Eigen::Matrix3d::Identity(), 1e-2)) {
    throw InvalidArgument(
        "{}: orientation is not a rotation (determinant {:g})", file, axes.determinant());
  }
  view->cam_from_world.rotation = Eigen::Quaterniond(NearestRotation(axes)).normalized();
  const std::vector<double> position = ReadNumbers(fields, "position", 3);
  const Eigen::Vector3d place(position[0], position[1], position[2]);
  CheckPositionRange(place, file);
  view->cam_from_world.translation = -(view->cam_from_world.rotation * place);
  const std::vector<double> size = ReadNumbers(fields, "image_size", 2);
  const std::vector<double> center = ReadNumbers(fields, "principal_point", 2);
  if (!(size[0] >= 1.0 && size[1] >= 1.0 && size[0] <= 1e6 && size[1] <= 1e6)) {
    throw InvalidArgument("{}: image_size is {:g} x {:g} px", file, size[0], size[1]);
  }
  if (std::abs(fields.NumberOr("skew", 0.0)) > 1e-6) {
    throw InvalidArgument("{}: skew is not supported", file);
  }
  const double focal = Positive(fields, "focal_length", -1.0);
  view->captured_camera = {static_cast<int>(std::lround(size[0])),
                           static_cast<int>(std::lround(size[1])),
                           focal,
                           focal * Positive(fields, "pixel_aspect_ratio", 1.0),
                           center[0],
                           center[1]};
  std::vector<double> radial(3, 0.0), tangential(2, 0.0);
  if (fields.Find("radial_distortion")) radial = ReadNumbers(fields, "radial_distortion", 3);
  if (fields.Find("tangential_distortion")) {
    tangential = ReadNumbers(fields, "tangential_distortion", 2);
  }
  view->distortion.k = {radial[0], radial[1], tangential[0], tangential[1], radial[2]};
  const auto& k = view->distortion.k;
  if (std::ranges::any_of(k, [](double v) { return v != 0.0; })) {
    view->distortion.model = Distortion::Model::kBrown;
  }
}

// Returns the picture of the frame, relative to the scene's folder; empty if there is none.
std::string FindPicture(const NamedFiles& photos, const std::string& name) {
  for (const char* scale : {"2x", "1x", "4x", "8x"}) {
    const std::string file = photos.Find(fmt::format("rgb/{}/{}", scale, name));
    if (file.starts_with("rgb/")) return file;
  }
  return "";
}

FrameTime ReadFrameTime(const json& entry, const std::string& name, const std::string& file) {
  const std::string place = fmt::format("{}: {}", kMetadata, name);
  if (!entry.is_object()) throw InvalidArgument("{} must be an object", place);
  const FrameFields fields(entry, entry, place);
  std::optional<double> step = fields.Number("time_id");
  if (!step) step = fields.Number("warp_id");
  FrameTime time{place, file, std::nullopt, ""};
  if (step) time.time = *step / kDefaultFramesPerSecond;
  time.camera = fmt::format("{:g}", fields.NumberOr("camera_id", 0.0));
  return time;
}

// Occlusion is unknown: a point lists the views whose picture it falls into.
std::vector<SparsePoint> ReadPoints(const fs::path& scene_folder, const Scene& scene) {
  if (!IsFile(scene_folder / kPoints)) return {};
  const NpyArray array = ReadNpy(ReadFile(scene_folder / kPoints), kPoints, 3 * kMaxPoints);
  if (array.shape.size() != 2 || array.shape[1] != 3) {
    throw InvalidArgument("{} must have three columns", kPoints);
  }
  std::vector<SparsePoint> points(array.shape[0]);
  for (size_t i = 0; i < points.size(); ++i) {
    points[i].position = Eigen::Map<const Eigen::Vector3d>(&array.values[3 * i]);
    points[i].reprojection_error_px = -1.0;
    points[i].views = ViewsFacing(scene, points[i].position, 0.0);
  }
  return points;
}

}  // namespace

bool IsNerfiesFolder(const fs::path& folder) {
  return IsFile(folder / kMetadata) && IsFolder(folder / "camera") && IsFolder(folder / "rgb");
}

Scene ReadNerfies(const fs::path& scene_folder,
                  std::vector<std::string>* warnings,
                  std::vector<std::string>* cameras) {
  const json frames = ParseObject(scene_folder, kMetadata);
  const NamedFiles photos = NamedFiles::Photos(scene_folder);
  Scene scene;
  std::vector<FrameTime> times;
  std::vector<std::string> missing;
  for (const auto& [name, entry] : frames.items()) {  // in order of names
    if (!IsSafeRelativePath(name)) {
      throw InvalidArgument("{}: '{}' is no name of a frame", kMetadata, name);
    }
    View view;
    view.image_file = FindPicture(photos, name);
    if (view.image_file.empty()) {
      missing.push_back(name);
      continue;
    }
    view.name = name + fs::path(view.image_file).extension().string();
    times.push_back(ReadFrameTime(entry, name, view.image_file));
    const std::string camera_file = "camera/" + name + ".json";
    ReadCamera(ParseObject(scene_folder, camera_file), camera_file, &view);
    FitViewToFile(scene_folder, &view);
    scene.views.push_back(std::move(view));
  }
  if (scene.views.size() < 2) {
    throw InvalidArgument(
        "{} names {} frames, of which {} have a picture in rgb/; at least 2 are "
        "needed",
        kMetadata,
        frames.size(),
        scene.views.size());
  }
  AddMoments(AssignMoments(times), &scene, warnings, cameras);
  if (warnings != nullptr && !missing.empty()) {
    warnings->push_back(
        fmt::format("{} of the {} frames of {} have no picture in rgb/ and were left out: {}",
                    missing.size(),
                    frames.size(),
                    kMetadata,
                    SummarizeNames(missing)));
  }
  std::ranges::sort(scene.views, {}, &View::name);
  scene.points = ReadPoints(scene_folder, scene);
  return scene;
}

}  // namespace color3d
