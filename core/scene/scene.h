// A posed scene: views with cameras, sparse points, and paths of the photos. Plain value;
// serialised as scene.json, the output of import and the input of every later stage.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/catalogue/captures.h"
#include "core/scene/camera.h"
#include "core/scene/relief.h"

namespace color3d {

// Time and camera of a frame of a film.
struct Moment {
  double time_s = 0.0;  // from the scene's first frame, >= 0
  int shot = 0;         // frames of one shot are of one camera, without a cut
  bool operator==(const Moment&) const = default;
};

struct View {
  std::string name;        // unique in the scene: the photo's path relative to the images folder
  std::string image_file;  // path of the photo relative to the scene's folder
  // Mask of the photo (photo_masks.h), relative to the scene's folder: the photo itself if its
  // alpha is the mask; empty: nothing is masked out.
  std::string mask_file;
  // Camera of the *undistorted* picture at full size, and of the photo as captured.
  Camera camera;
  Camera captured_camera;
  Distortion distortion;  // of captured_camera
  Pose cam_from_world;
  bool held_out = false;  // used for evaluation only, never by any trainer
  // Frames of films and of dynamic scenes only. Films need no poses: theirs are all equal, as are
  // those of a relief.
  std::optional<Moment> moment;

  // 0 for a photo.
  double time_s() const { return moment ? moment->time_s : 0.0; }
};

struct SparsePoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  double reprojection_error_px = 0.0;  // < 0: unknown
  std::vector<int> views;              // indices of the views that observe it, ascending
};

struct Scene {
  std::vector<View> views;  // sorted by name
  // Photos beside `views` whose cameras could not be found; their poses mean nothing. They are
  // coloured, but not reconstructed. Sorted by name.
  std::vector<View> unplaced;
  std::vector<SparsePoint> points;
  // Rescaling and recentring by import (import/normalise.h), which every writer and export undoes:
  // world = world_from_scene_scale * scene + world_offset.
  double world_from_scene_scale = 1.0;  // > 0
  Eigen::Vector3d world_offset = Eigen::Vector3d::Zero();
  // Frames of one static camera at the origin: depth is unknown, and this is assumed.
  std::optional<Relief> relief;
  // Photos whose cameras could not be found: poses mean nothing.
  bool are_pictures = false;

  std::vector<int> TrainingViews() const;
  std::vector<int> HeldOutViews() const;
  // Index of a view by name (or by file stem when that is unique); throws Error{kNotFound} naming
  // a few that exist.
  int FindView(std::string_view name) const;
  // Kind of the scene: kFilm, kDynamic and kRelief if each view has a moment. Films have one pose
  // for all views, which means none. kPictures if are_pictures, kStatic without views.
  CaptureKind kind() const;
  // True if each view has a moment, and there are views.
  bool HasTimes() const;
  const CaptureKindInfo& capture() const { return InfoOf(kind()); }
  // Indices of all views in order of time; views of equal time, or without one, keep their order.
  std::vector<int> ViewsInOrderOfTime() const;
  // The distinct times of the views, seconds, ascending.
  std::vector<double> Times() const;
  // Views of the shot of `view`, in order of time. Requires: the view has a moment.
  std::vector<int> FramesInShot(int view) const;
  // 1.1 x the largest distance of a training camera from their mean (3DGS "extent"); 1 when zero.
  double Extent() const;
  // In the world's units and frame.
  Eigen::Vector3d WorldFromScene(const Eigen::Vector3d& scene) const {
    return world_from_scene_scale * scene + world_offset;
  }
};

std::string SceneToJson(const Scene& scene);
// Throws Error{kInvalidArgument} naming the offending field.
Scene SceneFromJson(std::string_view json);

}  // namespace color3d
