#include "client/lib/photos/model_files.h"

#include <iterator>
#include <nlohmann/json.hpp>

#include "client/lib/photos/file_kind.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/catalogue/scene_files.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr char kTransforms[] = "transforms.json";
constexpr char kPosesBounds[] = "poses_bounds.npy";
constexpr const char* kNerfiesFiles[] = {
    "metadata.json", "dataset.json", "scene.json", "points.npy"};
constexpr const char* kModelFolders[] = {"sparse/0", "sparse", ""};
constexpr const char* kModelStems[] = {"cameras", "images", "points3D"};

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

std::set<std::string> FoldersThatTransformsNames(const fs::path& root_folder) {
  std::set<std::string> folders;
  const fs::path transforms = root_folder / kTransforms;
  if (!IsFile(transforms)) return folders;
  nlohmann::json root;
  try {
    root = nlohmann::json::parse(ReadFile(transforms));
  } catch (const nlohmann::json::exception& e) {
    throw InvalidArgument("{} is not JSON: {}", transforms.string(), e.what());
  }
  if (!root.is_object() || !root.contains("frames") || !root["frames"].is_array()) {
    throw InvalidArgument("{} has no \"frames\"", transforms.string());
  }
  for (const nlohmann::json& frame : root["frames"]) {
    if (!frame.is_object() || !frame.contains("file_path")) continue;
    if (!frame["file_path"].is_string()) continue;
    std::string path = frame["file_path"].get<std::string>();
    while (path.starts_with("./")) path.erase(0, 2);
    const size_t slash = path.rfind('/');
    if (slash == std::string::npos) continue;
    const std::string folder = path.substr(0, slash);
    if (IsSafeRelativePath(folder)) folders.insert(folder);
  }
  return folders;
}

void CollectModelFiles(const fs::path& root, PhotoFolder* folder_of_photos) {
  PhotoFolder& result = *folder_of_photos;
  std::vector<LocalFile> model;
  for (const std::string folder : kModelFolders) {
    std::vector<std::vector<LocalFile>> kinds;  // .bin, .txt
    for (const char* ending : {".bin", ".txt"}) {
      std::vector<LocalFile>& files = kinds.emplace_back();
      for (const char* stem : kModelStems) {
        const std::string name = std::string(stem) + ending;
        const std::string path = folder.empty() ? name : folder + "/" + name;
        if (IsFile(root / path)) files.push_back({path, root / path});
      }
    }
    // One whole model; parts of one go to the server too, which says what is missing.
    const bool whole_binary = kinds[0].size() == std::size(kModelStems);
    const bool whole_text = kinds[1].size() == std::size(kModelStems);
    if (whole_binary || !whole_text) model = kinds[0];
    if (!whole_binary) {
      model.insert(model.end(), kinds[1].begin(), kinds[1].end());
    }
    if (whole_text && !whole_binary) model = kinds[1];
    if (!model.empty()) break;
  }
  result.model_files.insert(result.model_files.end(), model.begin(), model.end());
  if (IsFile(root / kTransforms)) {
    result.model_files.push_back({kTransforms, root / kTransforms});
  } else if (!result.camera_films.empty() && IsFile(root / kPosesBounds)) {
    result.model_files.push_back({kPosesBounds, root / kPosesBounds});
  }
  if (!IsFile(root / kTimesFile)) return;
  const std::string times(kTimesFile);
  if (!model.empty()) {
    result.model_files.push_back({times, root / times});
  } else {
    result.notes.push_back(
        times + " is not read: it goes with a COLMAP model" +
        (result.model_files.empty()
             ? "; give one, or colour the frames of one moving camera with --film --poses"
             : "; transforms.json and metadata.json have times of their own"));
  }
}

}  // namespace color3d::client
