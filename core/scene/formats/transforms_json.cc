#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/scene/formats/frame_times.h"
#include "core/scene/formats/scene_readers.h"
#include "core/scene/formats/transforms_frame.h"
#include "core/scene/import.h"
#include "core/scene/photos.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

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

std::string WithoutPrefix(std::string text, const std::string& prefix) {
  while (text.compare(0, prefix.size(), prefix) == 0) text.erase(0, prefix.size());
  return text;
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
  view->captured_camera = ReadIntrinsics(fields, photo.stored_width, photo.stored_height);
  view->distortion = ReadDistortion(fields);
  view->cam_from_world = ReadTransform(fields);
  FitViewToPhoto(photo, view);
  return true;
}

struct Frame {
  View view;
  FrameTime time;
};

}  // namespace

Scene ReadTransformsJson(const fs::path& json_file,
                         const fs::path& scene_folder,
                         std::vector<std::string>* warnings) {
  const std::string file_name = json_file.filename().string();
  const json root = ParseFrames(ReadFile(json_file), file_name);
  std::vector<Frame> frames;
  std::vector<std::string> missing;
  for (size_t i = 0; i < root["frames"].size(); ++i) {
    const json& frame = root["frames"][i];
    const std::string place = fmt::format("{}: frame {}", file_name, i);
    if (!frame.is_object()) throw InvalidArgument("{} must be an object", place);
    const FrameFields fields(root, frame, place);
    Frame read;
    if (ReadFrame(fields, scene_folder, &read.view)) {
      read.time = {fields.Number("time"), fields.TextOr("camera", "")};
      frames.push_back(std::move(read));
    } else {
      missing.push_back(fields.TextOr("file_path", ""));
    }
  }
  std::sort(frames.begin(), frames.end(), [](const Frame& x, const Frame& y) {
    return x.view.name < y.view.name;
  });
  Scene scene;
  std::vector<FrameTime> times;
  for (Frame& frame : frames) {
    scene.views.push_back(std::move(frame.view));
    times.push_back(std::move(frame.time));
  }
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
  SetMoments(times, file_name, &scene.views);
  if (scene.IsFilm()) {
    throw InvalidArgument(
        "the {} frames of {} are of one camera that stands still: nothing can be reconstructed of "
        "them. Colour them as a film: leave {} out and give --film",
        scene.views.size(),
        file_name,
        file_name);
  }
  return scene;
}

}  // namespace color3d
