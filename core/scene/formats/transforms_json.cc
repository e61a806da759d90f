#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/scene/formats/scene_readers.h"
#include "core/scene/formats/transforms_frame.h"
#include "core/scene/frame_times.h"
#include "core/scene/import.h"
#include "core/scene/photos.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

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
  ReadFrameCamera(fields, photo.stored_width, photo.stored_height, view);
  FitViewToPhoto(photo, view);
  return true;
}

// When and by which camera, of the frame itself: no file says that of all its frames.
FrameTime ReadTime(const json& frame, const std::string& place, const std::string& file) {
  const FrameFields own(frame, frame, place);
  FrameTime time{place, file, own.Number("time"), ""};
  if (!time.time) return time;
  time.camera = own.TextOr("camera", "");
  *time.time += own.NumberOr("time_offset", 0.0);
  return time;
}

}  // namespace

Scene ReadTransformsJson(const fs::path& json_file,
                         const fs::path& scene_folder,
                         std::vector<std::string>* warnings,
                         std::vector<std::string>* cameras) {
  const std::string file_name = json_file.filename().string();
  const json root = ParseFrames(ReadFile(json_file), file_name);
  Scene scene;
  std::vector<std::string> missing;
  std::vector<FrameTime> times;
  for (size_t i = 0; i < root["frames"].size(); ++i) {
    const json& frame = root["frames"][i];
    const std::string place = fmt::format("{}: frame {}", file_name, i);
    if (!frame.is_object()) throw InvalidArgument("{} must be an object", place);
    const FrameFields fields(root, frame, place);
    View view;
    if (ReadFrame(fields, scene_folder, &view)) {
      times.push_back(ReadTime(frame, place, view.image_file));
      scene.views.push_back(std::move(view));
    } else {
      missing.push_back(fields.TextOr("file_path", ""));
    }
  }
  FrameMoments moments = MomentsOf(times);
  for (size_t i = 0; i < times.size(); ++i) scene.views[i].moment = moments.moments[i];
  if (!moments.note.empty() && warnings != nullptr) warnings->push_back(std::move(moments.note));
  if (cameras != nullptr) *cameras = std::move(moments.cameras);
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
