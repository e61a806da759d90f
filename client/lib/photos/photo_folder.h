// Selects the files of a user's folder that make up a scene. Reads names, small text files and the
// headers of HEIC pictures; never writes. Pure functions of the file system, thread-safe.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/catalogue/captures.h"

namespace color3d::client {

struct LocalFile {
  std::string path;            // in the scene, '/' separators, e.g. "images/0001.jpg"
  std::filesystem::path file;  // where its bytes are
};

struct PhotoFolder {
  std::filesystem::path root;
  std::vector<LocalFile> photos;         // sorted by path
  std::vector<LocalFile> model_files;    // poses and times, sorted by path
  std::vector<LocalFile> augment_files;  // pictures in colour for the colorizer, sorted by path
  std::vector<LocalFile> mask_files;     // of photos, see mask_files.h
  std::optional<LocalFile> splat;        // in place of photos: views are drawn from it
  std::optional<LocalFile> film;         // in place of photos: a video file, whose frames are views
  std::vector<LocalFile> camera_films;   // in place of photos: of several cameras
  std::vector<std::string> notes;        // for the user, one line each

  std::vector<LocalFile> AllFiles() const;
  // Layout of all files, as the server and import will detect it.
  CaptureLayout Layout() const;
  // For messages: the last part of the given path.
  std::string Name() const;
};

// Takes the photos (extensions of HasImageExtension) in images/ (ignoring case), at any depth, if
// it has any; else those in `root` itself and in the subfolders that transforms.json names; else,
// beside files with poses, those in the only subfolder with photos. Also takes the COLMAP models
// that catalogue/pose_files.h lists with times.txt in `root`, transforms.json (or Blender's
// transforms_train.json and the like) with its file of points, poses_bounds.npy, and everything in
// augment/ (any depth). Layout of Nerfies and HyperNeRF: metadata.json, camera/, points.npy and the
// pictures of one size, rgb/2x/, else 1x, 4x, 8x.
// Instead of photos, takes one splat (.ply .sog .spz) or film (.mp4 .mov ...): `root` itself, or
// the only one in a folder without photos; or several films, with a transforms.json that names them
// or a poses_bounds.npy, if there is one. Notes name the skipped files (skipped_files.h).
// `as_frames`: the caller calls UsePhotosAsFrames next; folders of pictures directly in `root` are
// taken, too, and messages speak of frames. Throws Error if there is no such folder, it is another
// kind of file, it has no photos or only one, it has more than 10,000 files, or names are unsafe or
// not UTF-8.
PhotoFolder CollectPhotos(const std::filesystem::path& root, bool as_frames = false);

// Turns the photos into frames of a film, in natural order of their names, or of several films if
// they lie in several folders, one for each camera. Files with poses are dropped. Throws
// Error{kInvalidArgument} if there are no photos, or two of one name.
void UsePhotosAsFrames(PhotoFolder* folder);

// Returns the photo with the file stem of `file` (the stem of "x/0007_coloured.png" is
// "0007_coloured"), as the name of a view: relative to images/. Empty if there is none, or more
// than one. Views of a splat are called view_01, view_02, ..., those of a film f000000, f000001,
// ...
std::string FindPhotoByStem(const PhotoFolder& folder, const std::filesystem::path& file);

// Throws Error{kNotFound} that names some photos if no photo has the path or the stem `name`.
// Accepts any name for splats and video files, whose views are unknown here.
void RequirePhoto(const PhotoFolder& folder, const std::string& name);

}  // namespace color3d::client
