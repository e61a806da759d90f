#include "client/lib/photos/photo_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "client/lib/names.h"
#include "client/lib/photos/film_advice.h"
#include "client/lib/photos/film_copies.h"
#include "client/lib/photos/model_files.h"
#include "client/lib/photos/skipped_files.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/base/text/name_order.h"
#include "core/base/text/utf8.h"
#include "core/catalogue/pose_files.h"
#include "core/catalogue/scene_files.h"
#include "core/image/probe/probe.h"

namespace color3d::client {
namespace fs = std::filesystem;
namespace {

constexpr size_t kMaxFiles = 10'000;
constexpr size_t kMaxPathBytes = 1024;
constexpr char kAugment[] = "augment";
constexpr const char* kNerfiesPictures[] = {"rgb/2x", "rgb/1x", "rgb/4x", "rgb/8x"};

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

// Adds the photos in `root`/`folder`.
void AddPhotos(const fs::path& root,
               const std::string& folder,
               bool with_subfolders,
               PhotoFolder* result,
               SkippedFiles* skipped) {
  for (const std::string& file : ListPictures(root / folder, with_subfolders, skipped)) {
    result->photos.push_back({folder.empty() ? file : folder + "/" + file, root / folder / file});
  }
}

// Returns the photos below `root`/`folder`, if the folder exists, as images/ of the scene.
void AddPhotosAsImages(const fs::path& root,
                       const std::string& folder,
                       PhotoFolder* result,
                       SkippedFiles* skipped) {
  if (folder.empty()) return;
  const size_t before = result->photos.size();
  AddPhotos(root, folder, /*with_subfolders=*/true, result, skipped);
  for (size_t i = before; i < result->photos.size(); ++i) {
    result->photos[i].path = "images/" + result->photos[i].path.substr(folder.size() + 1);
  }
}

void CollectNerfies(const fs::path& root, PhotoFolder* result, SkippedFiles* skipped) {
  for (const char* folder : kNerfiesPictures) {
    if (!result->photos.empty() || !IsFolder(root / folder)) continue;
    AddPhotos(root, folder, /*with_subfolders=*/false, result, skipped);
  }
  AddNerfiesFiles(root, &result->model_files);
}

// Returns films directly in `root` and in the folders that transforms.json names, and the file with
// the poses of their cameras, if there is one. Empty if there is only one film.
void CollectCameraFilms(const fs::path& root, PhotoFolder* result) {
  std::set<std::string> folders = {""};
  folders.merge(FoldersInTransforms(root));
  std::vector<LocalFile> films;
  std::error_code none;
  for (const std::string& folder : folders) {
    for (const auto& entry : fs::directory_iterator(root / folder, none)) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with('.') || !HasFilmExtension(name) || !IsFile(entry.path())) continue;
      if (IsResultFile(entry.path())) continue;
      films.push_back({folder.empty() ? name : folder + "/" + name, entry.path()});
    }
  }
  if (films.size() < 2) return;
  std::ranges::sort(films, {}, &LocalFile::path);
  // If a file names or counts the films, the server reports copies.
  const bool are_named = IsFile(root / kTransformsFile) || IsFile(root / kPosesBoundsFile);
  if (!are_named) RemoveCopies(&films, &result->notes);
  if (films.size() == 1) result->film = films[0];
  if (films.size() > 1) result->camera_films = std::move(films);
}

// Returns two or more folders of pictures in `root`: the frames of one camera each.
void CollectFoldersOfFrames(const fs::path& root, PhotoFolder* result, SkippedFiles* skipped) {
  std::error_code none;
  PhotoFolder folders;
  int count = 0;
  for (const auto& entry : fs::directory_iterator(root, none)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') || name == kAugment || !IsFolder(entry.path())) continue;
    if (IsSystemFolder(name)) continue;
    const size_t before = folders.photos.size();
    AddPhotos(root, name, /*with_subfolders=*/false, &folders, skipped);
    count += folders.photos.size() > before ? 1 : 0;
  }
  if (count > 1) result->photos = std::move(folders.photos);
}

void CollectImages(const fs::path& root, PhotoFolder* result, SkippedFiles* skipped) {
  if (IsNerfiesFolder(root)) return CollectNerfies(root, result, skipped);
  AddPhotosAsImages(root, ImagesFolder(root), result, skipped);
  if (!result->photos.empty()) return;
  AddPhotos(root, "", /*with_subfolders=*/false, result, skipped);
  std::vector<std::string> used;
  for (const std::string& folder : FoldersInTransforms(root)) {
    used.push_back(folder.substr(0, folder.find('/')));
    if (IsFolder(root / folder)) {
      AddPhotos(root, folder, /*with_subfolders=*/false, result, skipped);
    }
  }
  if (!result->photos.empty()) return AddUnusedNeighbors(root, used, skipped);
  if (HasPoses(root)) AddPhotosAsImages(root, FindSinglePhotoFolder(root), result, skipped);
}

// Includes all files, so that one of the wrong kind is refused by name instead of being skipped.
void CollectAugmentFiles(const fs::path& root, PhotoFolder* result) {
  if (!IsFolder(root / kAugment)) return;
  for (const std::string& file : ListFiles(root / kAugment)) {
    const fs::path path = root / kAugment / file;
    if (IsSystemPath(file)) continue;
    if (!HasImageExtension(file)) {
      throw InvalidArgument(
          "{} is not a picture ({}); augment/ is for pictures in colour that the colorizer learns "
          "from: move it elsewhere",
          path.string(),
          ReadableImageFormats());
    }
    result->augment_files.push_back({std::string(kAugment) + "/" + file, path});
  }
}

// Returns the only splat or film in a folder without photos.
std::optional<LocalFile> FindOnly(const fs::path& root,
                                  bool (*is_one)(std::string_view path),
                                  const char* what) {
  std::vector<std::string> found;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(root, none)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with('.') || !is_one(name) || !IsFile(entry.path())) continue;
    if (!IsResultFile(entry.path())) found.push_back(name);
  }
  if (found.empty()) return std::nullopt;
  if (found.size() > 1) {
    throw InvalidArgument("{} contains {} {}s and no photographs; give one of them (e.g. {})",
                          root.string(),
                          found.size(),
                          what,
                          (root / *std::ranges::min_element(found)).string());
  }
  return LocalFile{found[0], root / found[0]};
}

// "; it has a.txt, b.csv" of a folder without a picture; "" for an empty one.
std::string WhatIsThere(const fs::path& root) {
  constexpr size_t kShown = 3;
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(root, none)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with('.') && IsFile(entry.path())) names.push_back(EscapeControls(name));
  }
  if (names.empty()) return "";
  std::ranges::sort(names);
  const bool has_more = names.size() > kShown;
  names.resize(std::min(names.size(), kShown));
  return fmt::format("; it has {}{}", fmt::join(names, ", "), has_more ? ", ..." : "");
}

void CheckCounts(const PhotoFolder& folder, bool as_frames, const SkippedFiles& skipped) {
  const std::string root = folder.root.string();
  if (folder.splat || folder.film || !folder.camera_films.empty()) return;
  if (folder.photos.empty()) {
    const std::string sub = SubfolderWithPictures(folder.root);
    const std::string remedy =
        sub.empty() ? FolderAdvice(folder.root)
        : HasPoses(folder.root)
            ? "; the photos that its poses are of belong into " + (folder.root / "images").string()
            : "; did you mean " + (folder.root / sub).string() + "?";
    const std::string clause = skipped.Clause();
    throw InvalidArgument("{} contains no photographs ({}){}{}",
                          root,
                          ReadableImageFormats(),
                          remedy,
                          clause.empty() && remedy.empty() ? WhatIsThere(folder.root) : clause);
  }
  if (folder.photos.size() == 1 && as_frames) {
    throw InvalidArgument(
        "{} contains one picture ({}), and one frame is not a film; give the folder of all its "
        "frames{}",
        root,
        folder.photos[0].path,
        skipped.Clause());
  }
  if (folder.photos.size() == 1) {
    throw InvalidArgument("{} contains one photograph ({}); at least 3 that overlap are needed{}",
                          root,
                          folder.photos[0].path,
                          skipped.Clause());
  }
  const size_t files = folder.AllFiles().size();
  if (files > kMaxFiles) {
    throw InvalidArgument(
        "{} contains {} files; at most {} make up a scene", root, files, kMaxFiles);
  }
}

void AddNotes(const SkippedFiles& skipped, PhotoFolder* folder) {
  for (std::string& note : skipped.Notes()) folder->notes.push_back(std::move(note));
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

CaptureLayout PhotoFolder::Layout() const {
  std::vector<std::string> paths;
  for (LocalFile& file : AllFiles()) paths.push_back(std::move(file.path));
  return DetectCapture(paths);
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
  // "photos/." and "photos/" become "photos".
  result.root = root.lexically_normal();
  if (!result.root.has_filename() && result.root.has_relative_path()) {
    result.root = result.root.parent_path();
  }
  SkippedFiles skipped;
  CollectImages(result.root, &result, &skipped);
  if (result.photos.empty() && as_frames) {
    CollectFoldersOfFrames(result.root, &result, &skipped);
  }
  if (result.photos.empty()) CollectCameraFilms(result.root, &result);
  if (!result.camera_films.empty()) {
    CollectModelFiles(result.root, &result);
    CheckNames(result);
    AddNotes(skipped, &result);
    return result;
  }
  if (result.photos.empty() && !result.film) {
    result.splat = FindOnly(result.root, HasSplatExtension, "splat");
    if (!result.splat) result.film = FindOnly(result.root, HasFilmExtension, "film");
  }
  if (!result.splat && !result.film) CollectModelFiles(result.root, &result);
  CollectAugmentFiles(result.root, &result);
  std::ranges::sort(result.photos, {}, &LocalFile::path);
  std::ranges::sort(result.model_files, {}, &LocalFile::path);
  std::ranges::sort(result.augment_files, {}, &LocalFile::path);
  CheckCounts(result, as_frames, skipped);
  CheckNames(result);
  const fs::path parent = fs::absolute(result.root).parent_path();
  if (result.model_files.empty() && !result.splat && !result.film) {
    const std::string poses = FindSiblingPoses(parent);
    if (!poses.empty()) {
      result.notes.push_back("the poses in " + poses + " are not used; to use them, give " +
                             parent.string());
    }
  }
  AddNotes(skipped, &result);
  return result;
}

void UsePhotosAsFrames(PhotoFolder* folder) {
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
  std::ranges::sort(folder->photos, &ComesBefore, &LocalFile::path);
}

namespace {

bool IsNumbered(const std::string& stem, std::string_view prefix) {
  return stem.starts_with(prefix) && stem.size() > prefix.size() &&
         stem.find_first_not_of("0123456789", prefix.size()) == std::string::npos;
}

}  // namespace

std::string FindPhotoByStem(const PhotoFolder& folder, const fs::path& file) {
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
