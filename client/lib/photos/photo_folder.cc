#include "client/lib/photos/photo_folder.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "client/lib/names.h"
#include "client/lib/photos/film_advice.h"
#include "client/lib/photos/film_copies.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/name_order.h"
#include "core/base/utf8.h"
#include "core/catalogue/scene_files.h"
#include "core/image/probe/probe.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr size_t kMaxFiles = 10'000;
constexpr size_t kMaxPathBytes = 1024;
constexpr char kAugment[] = "augment";
constexpr char kTransforms[] = "transforms.json";
constexpr char kPosesBounds[] = "poses_bounds.npy";
constexpr const char* kNerfiesFiles[] = {
    "metadata.json", "dataset.json", "scene.json", "points.npy"};
constexpr const char* kNerfiesPictures[] = {"rgb/2x", "rgb/1x", "rgb/4x", "rgb/8x"};
constexpr const char* kModelFolders[] = {"sparse/0", "sparse", ""};
constexpr const char* kModelStems[] = {"cameras", "images", "points3D"};

bool IsFile(const fs::path& path) {
  std::error_code none;
  return fs::is_regular_file(path, none);
}
bool IsFolder(const fs::path& path) {
  std::error_code none;
  return fs::is_directory(path, none);
}

void RequireFolder(const fs::path& root) {
  if (IsFolder(root)) return;
  if (!fs::exists(fs::status(root))) {
    throw Error(ErrorCode::kNotFound,
                "there is no folder {}; give the folder of the photographs",
                root.string());
  }
  if (const std::string advice = FilmAdvice(root); !advice.empty()) throw InvalidArgument(advice);
  throw InvalidArgument(
      "{} is not a folder; give the folder of the photographs, a splat (.ply, .sog or .spz) or a "
      "film (.mp4, .mov, .mkv, ...)",
      root.string());
}

// Adds `root`/`folder`'s photos, without going into its subfolders.
void AddDirectPhotos(const fs::path& root, const std::string& folder, PhotoFolder* result) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(root / folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') || !HasImageExtension(name) || !IsFile(entry.path())) continue;
    result->photos.push_back({folder.empty() ? name : folder + "/" + name, entry.path()});
  }
  if (error) {
    throw Error(ErrorCode::kFailedPrecondition,
                "cannot read the folder {}: {}",
                (root / folder).string(),
                error.message());
  }
}

void AddPhotosBelow(const fs::path& root, const std::string& folder, PhotoFolder* result) {
  if (!IsFolder(root / folder)) return;
  for (const std::string& file : ListFiles(root / folder)) {
    if (!HasImageExtension(file)) continue;
    result->photos.push_back({folder + "/" + file, root / folder / file});
  }
}

// Subfolders of `root` that hold photos which transforms.json names.
std::set<std::string> NamedFolders(const fs::path& transforms) {
  nlohmann::json root;
  try {
    root = nlohmann::json::parse(ReadFile(transforms));
  } catch (const nlohmann::json::exception& e) {
    throw InvalidArgument("{} is not JSON: {}", transforms.string(), e.what());
  }
  std::set<std::string> folders;
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

bool IsNerfies(const fs::path& root) {
  return IsFile(root / kNerfiesFiles[0]) && IsFolder(root / "camera") && IsFolder(root / "rgb");
}

void CollectNerfies(const fs::path& root, PhotoFolder* result) {
  for (const char* folder : kNerfiesPictures) {
    if (result->photos.empty() && IsFolder(root / folder)) AddDirectPhotos(root, folder, result);
  }
  for (const char* file : kNerfiesFiles) {
    if (IsFile(root / file)) result->model_files.push_back({file, root / file});
  }
  for (const std::string& file : ListFiles(root / "camera")) {
    if (file.ends_with(".json")) {
      result->model_files.push_back({"camera/" + file, root / "camera" / file});
    }
  }
}

// Films directly in `root` and in the folders that transforms.json names, and the file that tells
// where their cameras stand, if there is one. Nothing when there is only one film.
void CollectCameraFilms(const fs::path& root, PhotoFolder* result) {
  const bool has_transforms = IsFile(root / kTransforms);
  std::set<std::string> folders = {""};
  if (has_transforms) folders.merge(NamedFolders(root / kTransforms));
  std::vector<LocalFile> films;
  std::error_code none;
  for (const std::string& folder : folders) {
    for (const auto& entry : fs::directory_iterator(root / folder, none)) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with('.') || !HasFilmExtension(name) || !IsFile(entry.path())) continue;
      films.push_back({folder.empty() ? name : folder + "/" + name, entry.path()});
    }
  }
  if (films.size() < 2) return;
  std::ranges::sort(films, {}, &LocalFile::path);
  // What names or counts the films decides itself: of those the server says which are copies.
  if (!has_transforms && !IsFile(root / kPosesBounds)) LeaveOutCopies(&films, &result->notes);
  if (films.size() == 1) result->film = films[0];
  if (films.size() > 1) result->camera_films = std::move(films);
  if (!has_transforms && IsFile(root / kPosesBounds)) {
    result->model_files.push_back({kPosesBounds, root / kPosesBounds});
  }
}

// Folders of pictures in `root`, two or more: each camera's frames.
void CollectFoldersOfFrames(const fs::path& root, PhotoFolder* result) {
  std::error_code none;
  PhotoFolder folders;
  int count = 0;
  for (const auto& entry : fs::directory_iterator(root, none)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') || name == kAugment || !IsFolder(entry.path())) continue;
    const size_t before = folders.photos.size();
    AddDirectPhotos(root, name, &folders);
    count += folders.photos.size() > before ? 1 : 0;
  }
  if (count > 1) result->photos = std::move(folders.photos);
}

void CollectImages(const fs::path& root, PhotoFolder* result) {
  if (IsNerfies(root)) return CollectNerfies(root, result);
  AddPhotosBelow(root, "images", result);
  if (!result->photos.empty()) return;
  AddDirectPhotos(root, "", result);
  if (!IsFile(root / kTransforms)) return;
  for (const std::string& folder : NamedFolders(root / kTransforms)) {
    if (IsFolder(root / folder)) AddDirectPhotos(root, folder, result);
  }
}

void CollectModel(const fs::path& root, PhotoFolder* result) {
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
  result->model_files.insert(result->model_files.end(), model.begin(), model.end());
  if (IsFile(root / kTransforms)) {
    result->model_files.push_back({kTransforms, root / kTransforms});
  }
  if (!IsFile(root / kTimesFile)) return;
  const std::string times(kTimesFile);
  if (!model.empty()) {
    result->model_files.push_back({times, root / times});
  } else {
    result->notes.push_back(
        times + " is not read: it goes with a COLMAP model" +
        (result->model_files.empty()
             ? "; give one, or colour the frames of one moving camera with --film --poses"
             : "; transforms.json and metadata.json have times of their own"));
  }
}

// All files, so that one of the wrong kind is refused by name instead of being passed over.
void CollectAugmentFiles(const fs::path& root, PhotoFolder* result) {
  if (!IsFolder(root / kAugment)) return;
  for (const std::string& file : ListFiles(root / kAugment)) {
    const fs::path path = root / kAugment / file;
    if (!HasImageExtension(file)) {
      throw InvalidArgument(
          "{} is no picture (JPEG, PNG or TIFF); augment/ is for pictures in colour that the "
          "colorizer learns from: move it elsewhere",
          path.string());
    }
    result->augment_files.push_back({std::string(kAugment) + "/" + file, path});
  }
}

// A subfolder with photos, to name it in the error.
std::string SubfolderWithPhotos(const fs::path& root) {
  std::error_code none;
  std::set<std::string> found;
  for (const auto& entry : fs::directory_iterator(root, none)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') || !IsFolder(entry.path())) continue;
    for (const auto& file : fs::directory_iterator(entry.path(), none)) {
      if (HasImageExtension(file.path().filename().string())) found.insert(name);
    }
  }
  return found.empty() ? "" : *found.begin();
}

// The only splat or film in a folder without photos.
std::optional<LocalFile> FindOnly(const fs::path& root,
                                  bool (*is_one)(std::string_view path),
                                  const char* what) {
  std::vector<std::string> found;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(root, none)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with('.') && is_one(name) && IsFile(entry.path())) found.push_back(name);
  }
  if (found.empty()) return std::nullopt;
  if (found.size() > 1) {
    throw InvalidArgument("{} contains {} {}s and no photographs; give one of them (e.g. {})",
                          root.string(),
                          found.size(),
                          what,
                          (root / *std::min_element(found.begin(), found.end())).string());
  }
  return LocalFile{found[0], root / found[0]};
}

void CheckCounts(const PhotoFolder& folder, bool as_frames) {
  const std::string root = folder.root.string();
  if (folder.splat || folder.film || !folder.camera_films.empty()) return;
  if (folder.photos.empty()) {
    const std::string sub = SubfolderWithPhotos(folder.root);
    throw InvalidArgument("{} contains no photographs (JPEG, PNG or TIFF){}",
                          root,
                          sub.empty() ? FolderAdvice(folder.root)
                                      : "; did you mean " + (folder.root / sub).string() + "?");
  }
  if (folder.photos.size() == 1 && as_frames) {
    throw InvalidArgument(
        "{} contains one picture ({}), and one frame is no film; give the folder of all its frames",
        root,
        folder.photos[0].path);
  }
  if (folder.photos.size() == 1) {
    throw InvalidArgument("{} contains one photograph ({}); at least 3 that overlap are needed",
                          root,
                          folder.photos[0].path);
  }
  const size_t files = folder.AllFiles().size();
  if (files > kMaxFiles) {
    throw InvalidArgument(
        "{} contains {} files; at most {} make up a scene", root, files, kMaxFiles);
  }
}

void CheckName(const LocalFile& file) {
  if (!IsUtf8(file.path)) {
    throw InvalidArgument("the name of {} is not UTF-8; rename it", file.file.string());
  }
  if (!IsSafeRelativePath(file.path) || file.path.size() > kMaxPathBytes) {
    throw InvalidArgument(
        "the name of {} is too long or has a backslash or a control character; rename it",
        file.file.string());
  }
}

void CheckNames(const PhotoFolder& folder) {
  for (const LocalFile& file : folder.AllFiles()) CheckName(file);
}

}  // namespace

std::vector<LocalFile> PhotoFolder::AllFiles() const {
  std::vector<LocalFile> all = photos;
  if (splat) all.push_back(*splat);
  if (film) all.push_back(*film);
  all.insert(all.end(), camera_films.begin(), camera_films.end());
  all.insert(all.end(), model_files.begin(), model_files.end());
  all.insert(all.end(), augment_files.begin(), augment_files.end());
  all.insert(all.end(), mask_files.begin(), mask_files.end());
  return all;
}

std::string PhotoFolder::Name() const {
  return fs::absolute(splat ? splat->file : film ? film->file : root).filename().string();
}

PhotoFolder CollectPhotos(const fs::path& root, bool as_frames) {
  PhotoFolder result;
  const std::string file = root.filename().string();
  if (IsFile(root) && (HasSplatExtension(file) || HasFilmExtension(file))) {
    result.root = root.parent_path();
    (HasSplatExtension(file) ? result.splat : result.film) = {file, root};
    CheckName({file, root});
    return result;
  }
  RequireFolder(root);
  // "photos/." and "photos/" are "photos".
  result.root = root.lexically_normal();
  if (!result.root.has_filename() && result.root.has_relative_path()) {
    result.root = result.root.parent_path();
  }
  CollectImages(result.root, &result);
  if (result.photos.empty() && as_frames) CollectFoldersOfFrames(result.root, &result);
  if (result.photos.empty()) CollectCameraFilms(result.root, &result);
  if (!result.camera_films.empty()) {
    CollectModel(result.root, &result);
    CheckNames(result);
    return result;
  }
  if (result.photos.empty() && !result.film) {
    result.splat = FindOnly(result.root, HasSplatExtension, "splat");
    if (!result.splat) result.film = FindOnly(result.root, HasFilmExtension, "film");
  }
  if (!result.splat && !result.film) CollectModel(result.root, &result);
  CollectAugmentFiles(result.root, &result);
  const auto by_path = [](const LocalFile& x, const LocalFile& y) { return x.path < y.path; };
  std::sort(result.photos.begin(), result.photos.end(), by_path);
  std::sort(result.model_files.begin(), result.model_files.end(), by_path);
  std::sort(result.augment_files.begin(), result.augment_files.end(), by_path);
  CheckCounts(result, as_frames);
  CheckNames(result);
  const fs::path parent = fs::absolute(result.root).parent_path();
  if (result.model_files.empty() && IsFolder(parent / "sparse")) {
    result.notes.push_back("the poses in " + (parent / "sparse").string() +
                           " are not used; to use them, give " + parent.string());
  }
  return result;
}

void TakeAsFrames(PhotoFolder* folder) {
  if (folder->film) return;
  if (!folder->camera_films.empty()) {
    throw InvalidArgument(
        "{} has {} films, of one camera each; give one of them (e.g. {}), or "
        "leave --film out: they become one scene",
        folder->root.string(),
        folder->camera_films.size(),
        folder->camera_films[0].file.string());
  }
  if (folder->photos.empty()) {
    throw InvalidArgument("{} has no pictures that could be frames of a film",
                          folder->root.string());
  }
  folder->model_files.clear();
  std::set<fs::path> cameras;
  for (const LocalFile& photo : folder->photos) cameras.insert(photo.file.parent_path());
  if (cameras.size() > 1 &&
      (cameras.contains(folder->root) || cameras.contains(folder->root / "images"))) {
    throw InvalidArgument(
        "{} has pictures beside folders of pictures; give one camera's frames, or each camera's in "
        "a folder of its own",
        folder->root.string());
  }
  std::set<std::string> names;
  for (LocalFile& photo : folder->photos) {
    const std::string camera =
        cameras.size() > 1 ? photo.file.parent_path().filename().string() + "/" : "";
    photo.path = std::string(kFramesFolder) + camera + photo.file.filename().string();
    if (!names.insert(photo.path).second) {
      throw InvalidArgument(
          "two pictures in {} are called {}{}; give each camera a folder of its own name",
          folder->root.string(),
          camera,
          photo.file.filename().string());
    }
  }
  const auto as_counted = [](const LocalFile& x, const LocalFile& y) {
    return ComesBefore(x.path, y.path);
  };
  std::sort(folder->photos.begin(), folder->photos.end(), as_counted);
}

namespace {

bool IsNumbered(const std::string& stem, std::string_view prefix) {
  return stem.starts_with(prefix) && stem.size() > prefix.size() &&
         stem.find_first_not_of("0123456789", prefix.size()) == std::string::npos;
}

}  // namespace

std::string PhotoOfSameStem(const PhotoFolder& folder, const fs::path& file) {
  const std::string wanted = file.stem().string();
  if (folder.splat) return IsNumbered(wanted, "view_") ? wanted + ".png" : "";
  if (folder.film) return IsNumbered(wanted, "f") ? wanted + ".png" : "";
  std::string found;
  for (const LocalFile& photo : folder.photos) {
    if (Stem(photo.path) != wanted) continue;
    if (!found.empty()) return "";
    found = photo.path;
    for (const std::string_view folder : {std::string_view("images/"), kFramesFolder}) {
      if (found.starts_with(folder)) found = found.substr(folder.size());
    }
  }
  return found;
}

void RequirePhoto(const PhotoFolder& folder, const std::string& name) {
  if (folder.splat || folder.film || !folder.camera_films.empty()) return;
  std::string known;
  for (size_t i = 0; i < folder.photos.size(); ++i) {
    const std::string& path = folder.photos[i].path;
    if (Stem(path) == Stem(name)) return;
    if (i < 3) known += (i == 0 ? "" : ", ") + fs::path(path).filename().string();
  }
  throw Error(ErrorCode::kNotFound,
              "no photo in {} is called '{}'; there are {}{}",
              folder.root.string(),
              name,
              known,
              folder.photos.size() > 3 ? ", ..." : "");
}

}  // namespace color3d::client
