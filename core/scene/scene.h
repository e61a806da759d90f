// A posed scene: views with cameras, sparse points, and where the photographs are. A plain value;
// serialised as scene.json, the output of the import stage and the input of every later one.
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

// When a frame of a film was taken, and by which camera.
struct Moment {
  double time_s = 0.0;  // from the scene's first frame, >= 0
  int shot = 0;         // frames of one shot are one camera's, without a cut between them
  bool operator==(const Moment&) const = default;
};

struct View {
  std::string name;        // unique in the scene: the photo's path relative to the images folder
  std::string image_file;  // path of the photo relative to the scene's folder
  // What counts of the photo (photo_masks.h), relative to the scene's folder: the photo
  // itself when its alpha tells; empty: all of it.
  std::string mask_file;
  // Camera of the *undistorted* picture at full size, and of the photo as captured.
  Camera camera;
  Camera captured_camera;
  Distortion distortion;  // of captured_camera
  Pose cam_from_world;
  bool held_out = false;  // used for evaluation only, never by any trainer
  // Of a frame of a film; none: the photo shows a place that stands still. Frames of a film need
  // not have poses: theirs are then all the same, as are those of a relief.
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
  std::vector<SparsePoint> points;
  // What import did to coordinates that float32 or the near plane could not bear
  // (import/normalise.h), and every writer and export undoes: world = world_from_scene_scale *
  // scene + world_offset.
  double world_from_scene_scale = 1.0;  // > 0
  Eigen::Vector3d world_offset = Eigen::Vector3d::Zero();
  // Frames of one camera that stands still, at the origin: no depth is known, this is assumed.
  std::optional<Relief> relief;

  std::vector<int> TrainingViews() const;
  std::vector<int> HeldOutViews() const;
  // Index of a view by name (or by file stem when that is unique); throws Error{kNotFound} naming
  // a few that exist.
  int FindView(std::string_view name) const;
  // Kind of the scene: kFilm, kDynamic and kRelief if each view has a moment. Films have one pose
  // for all views, which means none. kStatic without views.
  CaptureKind kind() const;
  const CaptureKindInfo& capture() const { return InfoOf(kind()); }
  // Indices of all views; those of one time, or without one, in their order.
  std::vector<int> ViewsInOrderOfTime() const;
  // The views' different times, seconds, ascending.
  std::vector<double> Times() const;
  // The views of that view's shot, in order of time. It must have a moment.
  std::vector<int> FramesOfShotOf(int view) const;
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
