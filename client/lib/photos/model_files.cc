#include "client/lib/photos/model_files.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "client/lib/photos/skipped_files.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/base/text/json_text.h"
#include "core/base/text/lower_case.h"
#include "core/catalogue/pose_files.h"
#include "core/catalogue/scene_files.h"
#include "core/image/probe/probe.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

constexpr const char* kNerfiesFiles[] = {
    "metadata.json", "dataset.json", "scene.json", "points.npy"};
constexpr int kDeepestModel = 5;       // levels below the user's folder
constexpr int kMostEntries = 200'000;  // examined for models

// Unsupported pose files of other programs.
struct UnreadPoses {
  const char* ending;
  const char* program;
};
constexpr UnreadPoses kUnreadPoses[] = {{"cameras.xml", "Agisoft Metashape"},
                                        {"bundle.out", "Bundler"},
                                        {".nvm", "VisualSFM"},
                                        {"reconstruction.json", "OpenSfM"},
                                        {"cameras.sfm", "Meshroom"},
                                        {"sfm.json", "Meshroom"}};

// Normalises the separators of a path from a user's file.
std::string NormalizedPath(std::string path) {
  std::ranges::replace(path, '\\', '/');
  while (path.starts_with("./")) path.erase(0, 2);
  return path;
}

// Returns names of folders in `root`, sorted.
std::vector<std::string> FoldersIn(const fs::path& root) {
  std::vector<std::string> folders;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(root, none)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') || IsSystemFolder(name)) continue;
    if (IsFolder(entry.path())) folders.push_back(name);
  }
  std::ranges::sort(folders);
  return folders;
}

// Returns transforms.json, or else Blender's files.
std::vector<std::string> TransformsIn(const fs::path& root) {
  if (IsFile(root / kTransformsFile)) return {std::string(kTransformsFile)};
  std::vector<std::string> files;
  for (const std::string_view file : kBlenderFiles) {
    if (IsFile(root / file)) files.emplace_back(file);
  }
  return files;
}

json ReadTransforms(const fs::path& file) {
  json root = ParseJson(ReadFile(file), file.string());
  if (!root.is_object() || !root.contains("frames") || !root["frames"].is_array()) {
    throw InvalidArgument("{} has no \"frames\"", file.string());
  }
  return root;
}

// Returns files below `root` with the names of a COLMAP model's files.
std::vector<std::string> FindModelFiles(const fs::path& root) {
  std::vector<std::string> files;
  std::error_code error;
  const auto options = fs::directory_options::skip_permission_denied |
                       fs::directory_options::follow_directory_symlink;
  int entries = 0;
  fs::recursive_directory_iterator it(root, options, error);
  const fs::recursive_directory_iterator end;
  for (; !error && it != end && entries < kMostEntries; it.increment(error), ++entries) {
    const std::string name = it->path().filename().string();
    if (IsFolder(it->path())) {
      if (name.starts_with('.') || it.depth() >= kDeepestModel) it.disable_recursion_pending();
      continue;
    }
    const std::string stem = it->path().stem().string();
    if (stem != "cameras" && stem != "images" && stem != "points3D") continue;
    files.push_back(it->path().lexically_relative(root).generic_string());
  }
  std::ranges::sort(files);
  return files;
}

std::vector<std::string> FindColmapFiles(const fs::path& root) {
  std::vector<std::string> files;
  for (const ColmapPlace& place : ColmapPlaces(FindModelFiles(root))) {
    files.insert(files.end(), place.files.begin(), place.files.end());
  }
  return files;
}

// Returns the file of points of transforms; empty if there is none.
std::string FindPointFile(const fs::path& root, const std::string& transforms) {
  const json named = ReadTransforms(root / transforms).value("ply_file_path", json());
  if (named.is_string()) {
    const std::string path = NormalizedPath(named.get<std::string>());
    for (const std::string& file : {path, path.substr(path.rfind('/') + 1)}) {
      if (IsSafeRelativePath(file) && IsFile(root / file)) return file;
    }
  }
  for (const std::string_view file : kPointFiles) {
    if (IsFile(root / file)) return std::string(file);
  }
  return "";
}

void NoteUnreadPoses(const fs::path& root, PhotoFolder* result) {
  std::error_code none;
  std::vector<std::string> found;
  for (const auto& entry : fs::directory_iterator(root, none)) {
    const std::string name = entry.path().filename().string();
    for (const UnreadPoses& poses : kUnreadPoses) {
      if (!LowerCase(name).ends_with(poses.ending) || !IsFile(entry.path())) continue;
      found.push_back(fmt::format("{} ({})", name, poses.program));
      break;
    }
  }
  if (found.empty()) return;
  std::ranges::sort(found);
  result->notes.push_back(fmt::format(
      "the poses in {} cannot be read and will be estimated; to use them, export them as a "
      "COLMAP model into {}",
      found[0],
      (root / "sparse").string()));
}

void NoteUnreadTimes(PhotoFolder* result) {
  result->notes.push_back(
      std::string(kTimesFile) + " is not read: it goes with a COLMAP model" +
      (result->model_files.empty()
           ? "; give one, or colour the frames of one moving camera with --film --poses"
           : "; transforms.json and metadata.json have times of their own"));
}

}  // namespace

bool IsNerfiesFolder(const fs::path& root) {
  return IsFile(root / kNerfiesFiles[0]) && IsFolder(root / "camera") && IsFolder(root / "rgb");
}

void AddNerfiesFiles(const fs::path& root, std::vector<LocalFile>* files) {
  for (const char* file : kNerfiesFiles) {
    if (IsFile(root / file)) files->push_back({file, root / file});
  }
  for (const std::string& file : ListFiles(root / "camera")) {
    if (file.ends_with(".json")) files->push_back({"camera/" + file, root / "camera" / file});
  }
}

std::set<std::string> FoldersInTransforms(const fs::path& root) {
  std::set<std::string> folders;
  for (const std::string& file : TransformsIn(root)) {
    const json transforms = ReadTransforms(root / file);
    for (const json& frame : transforms["frames"]) {
      if (!frame.is_object() || !frame.contains("file_path")) continue;
      if (!frame["file_path"].is_string()) continue;
      const std::string path = NormalizedPath(frame["file_path"].get<std::string>());
      const size_t slash = path.rfind('/');
      if (slash == std::string::npos) continue;
      const std::string folder = path.substr(0, slash);
      if (IsSafeRelativePath(folder)) folders.insert(folder);
    }
  }
  return folders;
}

std::string ImagesFolder(const fs::path& root) {
  if (IsFolder(root / "images")) return "images";
  for (const std::string& folder : FoldersIn(root)) {
    if (LowerCase(folder) == "images") return folder;
  }
  return "";
}

bool HasPoses(const fs::path& root) {
  return !TransformsIn(root).empty() || IsFile(root / kPosesBoundsFile) ||
         !FindColmapFiles(root).empty();
}

std::string FindSiblingPoses(const fs::path& root) {
  for (const char* folder : {"sparse", "colmap"}) {
    if (IsFolder(root / folder)) return (root / folder).string();
  }
  const std::vector<std::string> transforms = TransformsIn(root);
  if (!transforms.empty()) return (root / transforms[0]).string();
  const fs::path poses_bounds = root / kPosesBoundsFile;
  return IsFile(poses_bounds) ? poses_bounds.string() : "";
}

std::string FindSinglePhotoFolder(const fs::path& root) {
  std::string found;
  for (const std::string& folder : FoldersIn(root)) {
    if (IsAugmentFile(folder + "/") || IsMaskFile(folder + "/")) continue;
    if (ListPictures(root / folder, /*with_subfolders=*/false, nullptr).empty()) continue;
    if (!found.empty()) return "";
    found = folder;
  }
  return found;
}

void CollectModelFiles(const fs::path& root, PhotoFolder* folder) {
  std::vector<LocalFile>& files = folder->model_files;
  const auto add = [&](const std::string& file) { files.push_back({file, root / file}); };
  const std::vector<std::string> colmap = FindColmapFiles(root);
  for (const std::string& file : colmap) add(file);
  const std::vector<std::string> transforms = TransformsIn(root);
  for (const std::string& file : transforms) add(file);
  const bool of_photos = folder->camera_films.empty();
  if (of_photos && !transforms.empty()) {
    const std::string points = FindPointFile(root, transforms[0]);
    if (!points.empty()) add(points);
  }
  if (transforms.empty() && colmap.empty() && IsFile(root / kPosesBoundsFile)) {
    add(std::string(kPosesBoundsFile));
  }
  if (of_photos && files.empty()) NoteUnreadPoses(root, folder);
  if (!IsFile(root / kTimesFile)) return;
  if (colmap.empty()) return NoteUnreadTimes(folder);
  add(std::string(kTimesFile));
}

}  // namespace color3d::client
