// The made-up room with things that move in it, and everything known: pictures of several cameras
// at several times, depth, poses, what moves where, and the points that masked structure from
// motion would give, which lie on what stands still. For tests and benchmarks of scenes that move.
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
  bool moving_cameras = false;  // each goes along its own piece of the arc
  uint64_t seed = 1;            // moves furniture a little, changes all texture
  int supersampling = 2;        // samples per pixel along each axis, 1..8
  int sparse_points = 1500;     // 0..100000; each is seen from three places (or all, if fewer)
  int threads = 0;              // 0: all
  void Validate() const;        // throws Error{kInvalidArgument}
};

// The content of a view at one position.
struct SeenPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // world, m
  double depth = 0.0;                                  // along the camera's z axis, m
  int mover = -1;                                      // -1: it stands still
  Eigen::Vector3d on_mover = Eigen::Vector3d::Zero();  // its place in the mover's material
};

// Immutable, thread-safe. Same options, same scene, on any number of threads.
class DynamicScene {
 public:
  explicit DynamicScene(const DynamicSceneOptions& options);

  // As the importer would give it. Views "cam00/0000.png", ... camera by camera, with image files
  // below images/, the moment {time, camera}, no distortion, none held out; points lie on what
  // stands still, exactly, each with the views in which nothing hides it.
  const Scene& scene() const { return scene_; }
  int cameras() const { return options_.cameras; }
  int times() const { return times_; }
  int ViewOf(int camera, int time) const { return camera * times_ + time; }

  // True colours: 3 channels, sRGB in 0..1, not yet rounded to 8 bits.
  Image RenderSrgb(int view) const;
  // Depth along the camera's z axis at pixel centres, m: 1 channel.
  Image RenderDepth(int view) const;
  // 1 channel, 0..1: the share of each pixel that shows something that moves, appears or vanishes.
  // Where it is 0, cameras that stand still see the same colour at all times, to the last bit,
  // unless a mover is there at another time.
  Image RenderMovers(int view) const;

  SeenPoint Look(int view, double x_px, double y_px) const;
  // Where the point is at time step `time`; nothing while its mover is not there.
  std::optional<Eigen::Vector3d> Follow(const SeenPoint& point, int time) const;
  // True when the picture contains the position and nothing lies before it.
  bool Shows(int view, const Eigen::Vector3d& position) const;

 private:
  const View& ViewAt(int view) const { return scene_.views.at(static_cast<size_t>(view)); }
  const std::vector<std::optional<Solid>>& MovingGaussians(int view) const;
  // Of the things at the view's time the nearest that is nearer than `limit`; object -1: none.
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
  // Picture of the room for each standing camera; empty for cameras that move.
  std::vector<std::vector<RoomSample>> still_;
};

// Writes images/cam00/0000.png and so on with transforms.json beside, whose frames say their
// camera, their pose and their time.
void WriteDynamicScene(const std::filesystem::path& folder, const DynamicScene& made);

}  // namespace color3d
