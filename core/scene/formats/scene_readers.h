// Posed scenes in the formats of other programs. Every file that a model names is looked for among
// the files below `scene_folder`, and nowhere else; the returned views have `image_file` relative
// to it.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

// Which of a scene's COLMAP models is used: the one that places most of the photos given.
struct ColmapChoice {
  std::string folder;              // relative to the scene's folder
  size_t photos = 0;               // that it places
  std::vector<std::string> notes;  // of the other models, and of those that cannot be read
};
// Nothing where there is no model (catalogue/pose_files.h). Throws Error{kInvalidArgument} where
// none can be read.
std::optional<ColmapChoice> ChooseColmapModel(const std::filesystem::path& scene_folder);

// A COLMAP model, text or binary; with a times.txt in the scene's folder (colmap_model.h) the views
// have moments (frame_times.h). Names are matched with photos as in named_files.h; lines for photos
// that the model has not placed say nothing. Points without a track list the views into whose
// picture they fall. `warnings` (may be null) receives which photos are missing and were left out,
// what is wrong with cameras whose intrinsics do not fit their observations, and that times.txt
// names no photo of the model; `cameras` (may be null) the names of the cameras by Moment::shot.
// Throws Error{kInvalidArgument} naming the file and the place in it: fewer than two photos, photos
// that have no line where others have one, names that leave the scene's folder; and what MomentsOf
// refuses.
Scene ReadColmapModel(const std::filesystem::path& model_folder,
                      const std::filesystem::path& scene_folder,
                      std::vector<std::string>* warnings = nullptr,
                      std::vector<std::string>* cameras = nullptr);

// The transforms.json of NeRF and Nerfstudio, or the transforms_train.json, transforms_val.json and
// transforms_test.json of Blender, whose frames are taken together: all of `json_files`, in the
// scene's folder. With a `time` (and perhaps a `camera`) in every frame, as in D-NeRF, the views
// have moments (frame_times.h). Names are matched with photos as in named_files.h. Points are those
// of the file that `ply_file_path` names, else of sparse_pc.ply or points3d.ply, where there is
// one: in the frame of the poses, or where far more views see them so, with `applied_transform`
// applied. `warnings` and `cameras` as above; throws as ReadColmapModel, but photos that lie
// outside of the scene are left out.
Scene ReadTransformsJson(const std::vector<std::filesystem::path>& json_files,
                         const std::filesystem::path& scene_folder,
                         std::vector<std::string>* warnings = nullptr,
                         std::vector<std::string>* cameras = nullptr);
inline Scene ReadTransformsJson(const std::filesystem::path& json_file,
                                const std::filesystem::path& scene_folder,
                                std::vector<std::string>* warnings = nullptr,
                                std::vector<std::string>* cameras = nullptr) {
  return ReadTransformsJson(
      std::vector<std::filesystem::path>{json_file}, scene_folder, warnings, cameras);
}
// The files that ReadTransformsJson takes; empty where there are none.
std::vector<std::filesystem::path> TransformsFiles(const std::filesystem::path& scene_folder);
// How many of the photos given they place. Throws as ReadTransformsJson for what is no such file.
size_t CountTransformsPhotos(const std::vector<std::filesystem::path>& json_files,
                             const std::filesystem::path& scene_folder);

// The poses_bounds.npy of LLFF for photos: row i is of the i-th photo by name. Nothing, and a
// warning, where the numbers of rows and photos differ. Points as for transforms.json. Throws
// Error{kInvalidArgument}: as ReadPosesBounds.
std::optional<Scene> ReadPosesOfPhotos(const std::filesystem::path& scene_folder,
                                       std::vector<std::string>* warnings = nullptr);

}  // namespace color3d
