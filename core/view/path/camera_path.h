// Camera of a movie, frame by frame (EXPORT.md "Movies"). Pure functions.
#pragma once

#include <array>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

struct PathCamera {
  Camera camera;
  Pose cam_from_world;
  double time_s = 0.0;  // time in the scene; no effect in static scenes
};

// The camera with another picture size: scaled to cover width x height px, centred. Shows nothing
// outside the original picture; excess is cropped.
Camera CoverPicture(const Camera& camera, int width, int height);

// A smooth path through cameras at constant speed: Catmull-Rom curves through their centres,
// directions and focal lengths.
class SmoothPath {
 public:
  // Requires at least one camera; all have one picture size and finite poses. `unit`: the distance
  // that weighs as much as a rotation by one radian, e.g. the distance to the focus; > 0.
  SmoothPath(const std::vector<PathCamera>& knots, double unit);

  // The camera after this share of the path, 0..1 (clamped).
  PathCamera At(double share) const;
  // The share at which the path passes camera `i`: At(KnotAt(i)) is that camera.
  double KnotAt(size_t i) const { return way_.at(i * kSteps) / length_; }

 private:
  using Numbers = Eigen::Matrix<double, 11, 1>;  // centre, direction, log focal lengths, middle
  static constexpr size_t kSteps = 32;           // between neighbours, for the speed

  Numbers Curve(double time) const;  // time: 0..knots - 1, a knot at every whole number
  PathCamera CameraFrom(const Numbers& numbers) const;

  int width_ = 0, height_ = 0;
  std::vector<Numbers> knots_;  // one more before and after
  std::vector<double> gaps_;    // from each to the next, in curve parameters
  std::vector<double> way_;     // length of the path after each of kSteps between neighbours
  double length_ = 1.0;
};

// Shares of the path for `frames` frames, 0..1. Default: once from 0 to 1 with a gentle start and
// end. `bounce`: back and forth, so that the first frame follows the last. `closed`: the path
// returns to its beginning by itself.
std::vector<double> FrameShares(int frames, bool bounce, bool closed);

// Frames of the turn around the key view (turn.h) with its focal length, upright.
std::vector<PathCamera> TurnFrames(const Scene& scene,
                                   int key_view,
                                   const Eigen::Vector3d& focus,
                                   const std::vector<double>& shares);

// Natural order of names: "p2" before "p10".
std::vector<int> ViewsInOrder(const Scene& scene);

}  // namespace color3d
