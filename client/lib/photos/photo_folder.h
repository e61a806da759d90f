// Which files of a user's folder make up a scene. Reads names, small text files and the headers of
// HEIC pictures, never writes. Pure functions of
// the file system, thread-safe.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace color3d::client {

struct LocalFile {
  std::string path;            // in the scene, '/' separators, e.g. "images/0001.jpg"
  std::filesystem::path file;  // where its bytes are
};

struct PhotoFolder {
  std::filesystem::path root;
  std::vector<LocalFile> photos;         // sorted by path
  std::vector<LocalFile> model_files;    // tell poses and times, sorted by path
  std::vector<LocalFile> augment_files;  // pictures in colour for the colorizer, sorted by path
  std::vector<LocalFile> mask_files;     // of photos, see mask_files.h
  std::optional<LocalFile> splat;        // in place of photos: views are drawn from it
  std::optional<LocalFile> film;         // in place of photos: a video file, whose frames are views
  std::vector<LocalFile> camera_films;   // in place of photos: of several cameras
  std::vector<std::string> notes;        // what the user may want to know, one line each

  std::vector<LocalFile> AllFiles() const;
  // For people: the last part of the path that was given.
  std::string Name() const;
};

// Photos (endings of HasImageExtension) are taken from images/ (in any case of letters), at any
// depth, when there is one with photos; else from `root` itself and from the subfolders that
// transforms.json names; else, beside files that tell poses, from the only subfolder with photos.
// Also taken: the COLMAP models that catalogue/pose_files.h lists with the times.txt in `root`,
// transforms.json (or Blender's transforms_train.json and its like) with its file of points,
// poses_bounds.npy, and everything in augment/ (any depth). Of a folder of Nerfies or HyperNeRF:
// metadata.json, camera/, points.npy and the pictures of one size, rgb/2x/, else 1x, 4x, 8x.
// Nothing else, but for a splat (.ply .sog .spz) or a film (.mp4 .mov ...): `root` itself, or the
// only one in a folder without photos; or several films, with a transforms.json that names them or
// a poses_bounds.npy, if there is one. Notes say what was passed over (passed_over_files.h).
// `as_frames`: TakeAsFrames follows; folders of pictures directly in `root` are taken, too, and
// what is wrong is told of frames. Throws Error: no such folder, another file instead of a folder,
// no photos, one photo, more than 10,000 files, names that are not safe or not UTF-8.
PhotoFolder CollectPhotos(const std::filesystem::path& root, bool as_frames = false);

// The photos as frames of a film, in the order of their names (numbers count as numbers), or of
// several, where they lie in several folders: one camera's each. Poses that files tell are of no
// use then. Throws Error{kInvalidArgument} when there are none, or two of one name.
void TakeAsFrames(PhotoFolder* folder);

// The photo whose file stem is that of `file` ("x/0007_coloured.png" has the stem "0007_coloured"),
// as a view's name: relative to images/. Empty when none or several have it. Views of a splat are
// called view_01, view_02, ..., those of a film f000000, f000001, ...
std::string PhotoOfSameStem(const PhotoFolder& folder, const std::filesystem::path& file);

// Throws Error{kNotFound} that names some photos when no photo can be the view `name`: neither path
// nor stem fits. Views of a splat or a video are not known here: any name will do.
void RequirePhoto(const PhotoFolder& folder, const std::string& name);

}  // namespace color3d::client
