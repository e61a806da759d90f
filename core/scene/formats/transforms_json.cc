#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/catalogue/pose_files.h"
#include "core/scene/formats/given_points.h"
#include "core/scene/formats/scene_readers.h"
#include "core/scene/formats/transforms_frame.h"
#include "core/scene/frame_times.h"
#include "core/scene/named_files.h"
#include "core/scene/photos.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

struct Source {
  std::string name;
  json root;
};

std::vector<Source> ReadSources(const std::vector<fs::path>& files) {
  std::vector<Source> sources;
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    sources.push_back({name, ParseFrames(ReadFile(file), name)});
  }
  return sources;
}

std::string JoinNames(const std::vector<Source>& sources) {
  std::string names;
  for (const Source& source : sources) names += (names.empty() ? "" : " and ") + source.name;
  return names;
}

// A frame and the names in its file, before its photo is looked up.
struct Frame {
  const json* root = nullptr;
  const json* frame = nullptr;
  std::string place;
  std::string photo;
};

std::vector<Frame> ReadFrames(const std::vector<Source>& sources) {
  std::vector<Frame> frames;
  for (const Source& source : sources) {
    for (size_t i = 0; i < source.root["frames"].size(); ++i) {
      const json& frame = source.root["frames"][i];
      const std::string place = fmt::format("{}: frame {}", source.name, i);
      if (!frame.is_object()) throw InvalidArgument("{} must be an object", place);
      std::string photo = FrameFields(frame, frame, place).TextOr("file_path", "");
      if (photo.empty()) throw InvalidArgument("{}: file_path is missing", place);
      frames.push_back({&source.root, &frame, place, std::move(photo)});
    }
  }
  return frames;
}

// Returns the photo of each frame; empty if there is none.
std::vector<std::string> FindPhotos(const std::vector<Frame>& frames,
                                    const fs::path& scene_folder) {
  std::vector<std::string> names;
  for (const Frame& frame : frames) names.push_back(frame.photo);
  return NamedFiles::Photos(scene_folder).Find(names);
}

View ReadView(const FrameFields& fields, const std::string& file, const fs::path& scene_folder) {
  View view;
  view.image_file = file;
  view.name = ViewNameOf(file);
  Photo photo{view.name, view.image_file};
  ProbePhoto(scene_folder, &photo);
  ReadFrameCamera(fields, photo.stored_width, photo.stored_height, &view);
  FitViewToPhoto(photo, &view);
  return view;
}

// Time and camera of the frame itself; the top of a file has no defaults for them.
FrameTime ReadTime(const json& frame, const std::string& place, const std::string& file) {
  const FrameFields own(frame, frame, place);
  FrameTime time{place, file, own.Number("time"), ""};
  if (!time.time) return time;
  time.camera = own.TextOr("camera", "");
  *time.time += own.NumberOr("time_offset", 0.0);
  return time;
}

void NoteMissing(const std::vector<std::string>& missing,
                 size_t total,
                 size_t found,
                 const std::string& file_name,
                 std::vector<std::string>* warnings) {
  if (found < 2) {
    throw InvalidArgument(
        "{} names {} photos, of which {} are among those given; at least 2 are needed{}",
        file_name,
        total,
        found,
        missing.empty() ? "" : fmt::format(" (missing: {})", SummarizeNames(missing)));
  }
  if (missing.empty() || warnings == nullptr) return;
  warnings->push_back(
      fmt::format("{} of the {} photos that {} names are not among those given and were left out: "
                  "{}",
                  missing.size(),
                  total,
                  file_name,
                  SummarizeNames(missing)));
}

void RejectDuplicateFrames(const std::vector<Frame>& frames,
                           const std::vector<std::string>& files,
                           const std::string& file_name) {
  std::map<std::string, size_t> frame_of_file;
  for (size_t i = 0; i < files.size(); ++i) {
    if (files[i].empty()) continue;
    const auto [other, fresh] = frame_of_file.emplace(files[i], i);
    if (fresh) continue;
    throw InvalidArgument("{} names the photo {} twice ({} and {})",
                          file_name,
                          ViewNameOf(files[i]),
                          frames[other->second].place,
                          frames[i].place);
  }
}

}  // namespace

std::vector<fs::path> TransformsFiles(const fs::path& scene_folder) {
  if (const fs::path file = scene_folder / kTransformsFile; IsFile(file)) {
    return {file};
  }
  std::vector<fs::path> files;
  for (const std::string_view name : kBlenderFiles) {
    if (IsFile(scene_folder / name)) files.push_back(scene_folder / name);
  }
  return files;
}

size_t CountTransformsPhotos(const std::vector<fs::path>& json_files,
                             const fs::path& scene_folder) {
  const std::vector<Source> sources = ReadSources(json_files);
  const std::vector<std::string> files = FindPhotos(ReadFrames(sources), scene_folder);
  return files.size() - static_cast<size_t>(std::ranges::count(files, ""));
}

Scene ReadTransformsJson(const std::vector<fs::path>& json_files,
                         const fs::path& scene_folder,
                         std::vector<std::string>* warnings,
                         std::vector<std::string>* cameras) {
  const std::vector<Source> sources = ReadSources(json_files);
  const std::string file_name = JoinNames(sources);
  const std::vector<Frame> frames = ReadFrames(sources);
  const std::vector<std::string> files = FindPhotos(frames, scene_folder);
  RejectDuplicateFrames(frames, files, file_name);
  Scene scene;
  std::vector<std::string> missing;
  std::vector<FrameTime> times;
  for (size_t i = 0; i < frames.size(); ++i) {
    const Frame& frame = frames[i];
    if (files[i].empty()) {
      missing.push_back(frame.photo);
      continue;
    }
    const FrameFields fields(*frame.root, *frame.frame, frame.place);
    times.push_back(ReadTime(*frame.frame, frame.place, files[i]));
    scene.views.push_back(ReadView(fields, files[i], scene_folder));
  }
  NoteMissing(missing, frames.size(), scene.views.size(), file_name, warnings);
  AddMoments(AssignMoments(times), &scene, warnings, cameras);
  std::ranges::sort(scene.views, {}, &View::name);
  if (sources.size() > 1 && warnings != nullptr) {
    warnings->push_back(fmt::format("the frames of {} are taken together", file_name));
  }
  scene.points =
      ReadGivenPoints(sources.front().root, sources.front().name, scene_folder, scene, warnings);
  return scene;
}

}  // namespace color3d
