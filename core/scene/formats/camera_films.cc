#include "core/scene/formats/camera_films.h"

#include <fmt/core.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "core/base/equal_files.h"
#include "core/base/error.h"
#include "core/base/file_kind.h"
#include "core/base/files.h"
#include "core/catalogue/scene_files.h"
#include "core/image/probe/probe.h"
#include "core/scene/formats/poses_bounds.h"
#include "core/scene/formats/transforms_frame.h"
#include "core/scene/named_files.h"
#include "core/scene/photos.h"

namespace color3d {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

constexpr char kTransforms[] = "transforms.json";

std::string FilmPath(const FrameFields& frame) {
  std::string file = frame.TextOr("file_path", "");
  while (file.starts_with("./")) file.erase(0, 2);
  return file;
}

void FitToFilm(const std::pair<int, int>& size, CameraFilm* film) {
  const auto [width, height] = size;
  FitViewToPhoto({film->file, film->file, width, height, 1, width, height}, &film->view);
}

CameraFilm ReadFilm(const FrameFields& own,
                    const FrameFields& fields,
                    const NamedFiles& given,
                    const FilmSize& size) {
  CameraFilm film;
  film.file = given.Find(FilmPath(fields));
  if (film.file.empty()) {
    throw InvalidArgument("{}: there is no film {} in the scene", fields.place(), FilmPath(fields));
  }
  film.camera = own.TextOr("camera", fs::path(film.file).stem().string());
  film.time_offset_s = own.NumberOr("time_offset", 0.0);
  const auto [width, height] = size(film.file);
  film.has_pose = own.Find("transform_matrix") != nullptr;
  if (!film.has_pose) return film;
  ReadFrameCamera(fields, width, height, &film.view);
  FitToFilm({width, height}, &film);
  return film;
}

std::vector<CameraFilm> FilmsOfTransforms(const fs::path& scene_folder, const FilmSize& size) {
  const json root = ParseFrames(ReadFile(scene_folder / kTransforms), kTransforms);
  const NamedFiles given = NamedFiles::Films(scene_folder);
  std::vector<CameraFilm> films;
  std::string photo;
  for (size_t i = 0; i < root["frames"].size(); ++i) {
    const json& frame = root["frames"][i];
    const std::string place = fmt::format("{}: frame {}", kTransforms, i);
    if (!frame.is_object()) throw InvalidArgument("{} must be an object", place);
    const FrameFields own(frame, frame, place);
    if (!HasFilmExtension(FilmPath(own))) {
      photo = place;
      continue;
    }
    if (own.Find("time") != nullptr) {
      throw InvalidArgument(
          "{}: {} is a film, whose frames have times of their own; leave `time` out",
          place,
          FilmPath(own));
    }
    films.push_back(ReadFilm(own, FrameFields(root, frame, place), given, size));
  }
  if (!films.empty() && !photo.empty()) {
    throw InvalidArgument(
        "{} names the film {}, but {} is not a film; give films or pictures, not both",
        kTransforms,
        films[0].file,
        photo);
  }
  return films;
}

void CheckFilms(const std::vector<CameraFilm>& films, const std::string& from) {
  std::set<std::string> cameras, files;
  for (const CameraFilm& film : films) {
    if (film.has_pose != films[0].has_pose) {
      const CameraFilm& without = film.has_pose ? films[0] : film;
      throw InvalidArgument(
          "{}: {} has no transform_matrix, but others have one; give it to every film, or to none: "
          "then all are looked for",
          from,
          without.file);
    }
    if (!files.insert(film.file).second) {
      throw InvalidArgument("{} names the film {} twice", from, film.file);
    }
    if (!cameras.insert(film.camera).second) {
      throw InvalidArgument(
          "{}: two films are of the camera {}; give each a `camera` of its own", from, film.camera);
    }
    if (film.camera.find('/') != std::string::npos || !IsSafeRelativePath(film.camera)) {
      throw InvalidArgument(
          "{}: a camera cannot be called '{}'; its frames lie in a folder of that "
          "name",
          from,
          film.camera);
    }
  }
  if (films.size() < 2 && !films[0].has_pose) {
    throw InvalidArgument("{} names one film; colour it as a film, without {}", from, from);
  }
  if (films.size() < 2) {
    throw InvalidArgument(
        "{} has the pose of one film; a static camera gives no depth. Colour it as a film, without "
        "{}",
        from,
        from);
  }
}

// Returns the files of the film's pictures, in order.
std::vector<fs::path> PictureFiles(const CameraFilm& film, const fs::path& scene_folder) {
  if (!film.is_pictures) return {scene_folder / film.file};
  std::vector<fs::path> files;
  for (const std::string& file : ListFiles(scene_folder / film.file)) {
    if (HasImageExtension(file)) files.push_back(scene_folder / film.file / file);
  }
  return files;
}

// Throws for copies: they show nothing from a second position.
void RejectDuplicateFilms(const std::vector<CameraFilm>& films, const fs::path& scene_folder) {
  std::map<std::vector<uintmax_t>, std::vector<const CameraFilm*>> by_sizes;
  for (const CameraFilm& film : films) {
    std::vector<uintmax_t> sizes;
    std::error_code error;
    for (const fs::path& file : PictureFiles(film, scene_folder)) {
      sizes.push_back(fs::file_size(file, error));
    }
    std::vector<const CameraFilm*>& alike = by_sizes[sizes];
    const std::vector<fs::path> files = PictureFiles(film, scene_folder);
    for (const CameraFilm* other : alike) {
      const std::vector<fs::path> of_other = PictureFiles(*other, scene_folder);
      if (std::ranges::equal(files, of_other, &HaveEqualBytes)) {
        throw InvalidArgument(
            "{} and {} are the same film, byte for byte; films of several cameras are each taken "
            "from another place: leave one of them out",
            other->file,
            film.file);
      }
    }
    alike.push_back(&film);
  }
}

// Returns the folders in frames/, one for each camera; empty if there are fewer than two.
std::vector<CameraFilm> FoldersOfPictures(const std::vector<std::string>& files) {
  std::set<std::string> folders;
  std::string direct;
  for (const std::string& file : files) {
    if (!IsFrameFile(file) || !HasImageExtension(file)) continue;
    const size_t slash = file.rfind('/');
    if (slash < kFramesFolder.size()) {
      direct = file;
    } else {
      folders.insert(file.substr(0, slash));
    }
  }
  if (!folders.empty() && !direct.empty()) {
    throw InvalidArgument(
        "{} lies beside the folder {}; give each camera's frames a folder, or all frames of one "
        "camera without folders",
        direct,
        *folders.begin());
  }
  std::vector<CameraFilm> films;
  if (folders.size() < 2) return films;
  for (const std::string& folder : folders) {
    films.push_back({.camera = folder.substr(kFramesFolder.size()),
                     .file = folder,
                     .has_pose = false,
                     .is_pictures = true});
  }
  return films;
}

// Returns the films of a folder that has no other pictures.
std::vector<CameraFilm> FilmsWithoutPoses(const std::vector<std::string>& files) {
  std::vector<CameraFilm> films;
  for (const std::string& file : files) {
    if (IsAugmentFile(file) || IsMaskFile(file)) continue;
    if (HasImageExtension(file)) return {};
    if (!HasFilmExtension(file)) continue;
    films.push_back({.camera = fs::path(file).stem().string(), .file = file, .has_pose = false});
  }
  if (films.size() < 2) films.clear();
  return films;
}

}  // namespace

std::vector<CameraFilm> ReadCameraFilms(const fs::path& scene_folder, const FilmSize& size_of) {
  if (!IsFolder(scene_folder)) return {};
  const std::vector<std::string> files = ListFiles(scene_folder);
  std::vector<CameraFilm> films = FoldersOfPictures(files);
  std::string from = "frames/";
  if (films.empty() && std::ranges::any_of(files, HasFilmExtension)) {
    if (IsFile(scene_folder / kTransforms)) {
      from = kTransforms;
      films = FilmsOfTransforms(scene_folder, size_of);
    } else if (IsFile(scene_folder / kPosesBounds)) {
      from = kPosesBounds;
      films = ReadPosesBounds(scene_folder);
      for (CameraFilm& film : films) FitToFilm(size_of(film.file), &film);
    } else {
      from = "the scene";
      films = FilmsWithoutPoses(files);
    }
  }
  if (films.empty()) return films;
  CheckFilms(films, from);
  RejectDuplicateFilms(films, scene_folder);
  std::ranges::sort(films, {}, &CameraFilm::camera);
  return films;
}

}  // namespace color3d
