// Reads posed scenes in the formats of other programs. Files that a model names are looked for
// among the files below `scene_folder` only; `image_file` of the returned views is relative to it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// The COLMAP model that is used: the one that places most of the photos given.
struct ColmapChoice {
  std::string folder;              // relative to the scene's folder
  size_t photos = 0;               // that it places
  std::vector<std::string> notes;  // of the other models, and of those that cannot be read
};
// Returns nullopt if there is no model (catalogue/pose_files.h). Throws Error{kInvalidArgument} if
// there are models but none can be read.
std::optional<ColmapChoice> ChooseColmapModel(const std::filesystem::path& scene_folder);

// Reads a COLMAP model, text or binary. With a times.txt in the scene's folder (colmap_model.h) the
// views have moments (frame_times.h). Names are matched with photos as in named_files.h; lines of
// times.txt for photos that the model has not placed are ignored. Points without a track list the
// views whose picture they fall into. `warnings` (may be null) receives the missing photos, which
// are left out, the cameras whose intrinsics do not fit their observations, and a times.txt that
// names no photo of the model; `cameras` (may be null) the camera names by Moment::shot. Throws
// Error{kInvalidArgument} naming file and place if there are fewer than two photos, only some
// photos have a line in times.txt, or a name leaves the scene's folder; and as AssignMoments.
Scene ReadColmapModel(const std::filesystem::path& model_folder,
                      const std::filesystem::path& scene_folder,
                      std::vector<std::string>* warnings = nullptr,
                      std::vector<std::string>* cameras = nullptr);

// Reads the transforms.json of NeRF and Nerfstudio, or Blender's transforms_train.json,
// transforms_val.json and transforms_test.json, whose frames are merged: all of `json_files`, in
// the scene's folder. If every frame has a `time` (and optionally a `camera`), as in D-NeRF, the
// views have moments (frame_times.h). Names are matched with photos as in named_files.h. Points: as
// ReadGivenPoints. `warnings` and `cameras`: as above. Throws as ReadColmapModel, except that
// photos outside of the scene are left out.
Scene ReadTransformsJson(const std::vector<std::filesystem::path>& json_files,
                         const std::filesystem::path& scene_folder,
                         std::vector<std::string>* warnings = nullptr,
                         std::vector<std::string>* cameras = nullptr);

// Returns the files that ReadTransformsJson reads; empty if there are none.
std::vector<std::filesystem::path> TransformsFiles(const std::filesystem::path& scene_folder);
// Returns the number of given photos that they place. Throws as ReadTransformsJson for files that
// are not of this format.
size_t CountTransformsPhotos(const std::vector<std::filesystem::path>& json_files,
                             const std::filesystem::path& scene_folder);

// Reads LLFF's poses_bounds.npy for photos: row i belongs to the i-th photo by name. Returns
// nullopt, with a warning, if the numbers of rows and photos differ. Points: as for
// transforms.json. Throws Error{kInvalidArgument}: as ReadPosesBounds.
std::optional<Scene> ReadPosesOfPhotos(const std::filesystem::path& scene_folder,
                                       std::vector<std::string>* warnings = nullptr);

}  // namespace color3d
