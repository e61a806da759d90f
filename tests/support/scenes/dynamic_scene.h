// Synthetic room with moving objects and exact ground truth: pictures of several cameras at several
// times, depth, poses, motion, and points on the background as from masked structure-from-motion.
// For tests and benchmarks of dynamic scenes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "core/base/image.h"
#include "core/scene/scene.h"
#include "tests/support/scenes/movers.h"
#include "tests/support/scenes/room.h"
#include "tests/support/scenes/room_views.h"

namespace color3d {

struct DynamicSceneOptions {
  DynamicCase which = DynamicCase::kSliding;
  // 1..8, on an arc. A single static one makes a film (CaptureKind::kFilm).
  int cameras = 6;
  // 1..1000 time steps of 1/8 s; 0: 1 for kOneStep, which takes no other, 8 for kStill, else 12.
  int times = 0;
  int width = 128;              // px, 16..512
  int height = 96;              // px, 16..512
  bool moving_cameras = false;  // each moves along its part of the arc
  uint64_t seed = 1;            // moves furniture slightly, changes all textures
  int supersampling = 2;        // samples per pixel along each axis, 1..8
  int sparse_points = 1500;  // 0..100000; each is observed from three positions (or all, if fewer)
  int threads = 0;           // 0: all
  void Validate() const;     // throws Error{kInvalidArgument}
};

// The content of a view at one position.
struct SeenPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // world, m
  double depth = 0.0;                                  // along the camera's z axis, m
  int mover = -1;                                      // -1: background
  Eigen::Vector3d on_mover = Eigen::Vector3d::Zero();  // position in the mover's material
};

// Immutable, thread-safe. Equal options give equal scenes on any number of threads.
class DynamicScene {
 public:
  explicit DynamicScene(const DynamicSceneOptions& options);

  // The scene as imported. Views "cam00/0000.png", ... camera by camera, with image files below
  // images/ and the moment {time, camera}, without distortion or held-out views. Points lie exactly
  // on the background, with the views in which they are visible.
  const Scene& scene() const { return scene_; }
  int cameras() const { return options_.cameras; }
  int times() const { return times_; }
  int ViewOf(int camera, int time) const { return camera * times_ + time; }

  // True colours: 3 channels, sRGB in 0..1, not yet rounded to 8 bits.
  Image RenderSrgb(int view) const;
  // Depth along the camera's z axis at pixel centres, m: 1 channel.
  Image RenderDepth(int view) const;
  // 1 channel, 0..1: share of each pixel covered by objects that move, appear or vanish. Where it
  // is 0, static cameras see the same colour at all times, to the last bit, unless a mover is there
  // at another time.
  Image RenderMovers(int view) const;

  SeenPoint Look(int view, double x_px, double y_px) const;
  // Position of the point at time step `time`; nullopt while its mover is absent.
  std::optional<Eigen::Vector3d> Follow(const SeenPoint& point, int time) const;
  // Returns true if the position is inside the picture and not occluded.
  bool Shows(int view, const Eigen::Vector3d& position) const;

 private:
  const View& ViewAt(int view) const { return scene_.views.at(static_cast<size_t>(view)); }
  const std::vector<std::optional<Solid>>& MovingGaussians(int view) const;
  // Nearest object at the view's time that is nearer than `limit`; object -1: none.
  Hit TraceMovers(int view,
                  const Eigen::Vector3d& origin,
                  const Eigen::Vector3d& direction,
                  double limit) const;
  RoomSample StillSample(int view, int x, int y, int index) const;
  void AddViews();
  void KeepStillSamples();
  void AddSparsePoints();

  DynamicSceneOptions options_;
  int times_;
  Room room_;
  std::vector<std::vector<std::optional<Solid>>> movers_;  // per time step
  Scene scene_;
  // Picture of the room for each static camera; empty for moving cameras.
  std::vector<std::vector<RoomSample>> still_;
};

// Writes images/cam00/0000.png and so on, and transforms.json with camera, pose and time of each
// frame.
void WriteDynamicScene(const std::filesystem::path& folder, const DynamicScene& made);

}  // namespace color3d
