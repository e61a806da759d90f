// Where the camera of a movie stands, frame by frame (EXPORT.md "Movies"). Pure functions.
#pragma once

#include <array>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

struct PathCamera {
  Camera camera;
  Pose cam_from_world;
  double time_s = 0.0;  // of the scene; says nothing where nothing moves
};

// The camera with another picture: scaled to cover width x height px, with its middle in the
// middle. Nothing comes into sight that was not there; what sticks out is cut off.
Camera CoverPicture(const Camera& camera, int width, int height);

// A smooth way through cameras: Catmull-Rom curves through their centres, directions and focal
// lengths, at an even speed.
class SmoothPath {
 public:
  // At least one camera, all of one picture size, on finite poses. `unit`: the distance that is
  // worth as much of the way as a turn by one radian, e.g. to what the cameras look at; > 0.
  SmoothPath(const std::vector<PathCamera>& knots, double unit);

  // After this share of the way, 0..1 (clamped).
  PathCamera At(double share) const;
  // When it passes the camera `i`: At(KnotAt(i)) is that camera.
  double KnotAt(size_t i) const { return way_.at(i * kSteps) / length_; }

 private:
  using Numbers = Eigen::Matrix<double, 11, 1>;  // centre, direction, log focal lengths, middle
  static constexpr size_t kSteps = 32;           // between neighbours, for the speed

  Numbers Curve(double time) const;  // time: 0..knots - 1, a knot at every whole number
  PathCamera CameraFrom(const Numbers& numbers) const;

  int width_ = 0, height_ = 0;
  std::vector<Numbers> knots_;  // one more before and after
  std::vector<double> gaps_;    // from each to the next, as the curve counts
  std::vector<double> way_;     // made after each of kSteps between neighbours
  double length_ = 1.0;
};

// Shares of the way for `frames` frames, 0..1. Forth: from 0 to 1 at an even speed that begins and
// ends gently. `bounce`: there and back, so that the last frame is followed by the first. `closed`:
// the way comes back to its beginning by itself.
std::vector<double> FrameShares(int frames, bool bounce, bool closed);

// Frames on the turn around the key view (turn.h) with its focal length, upright.
std::vector<PathCamera> TurnFrames(const Scene& scene,
                                   int key_view,
                                   const Eigen::Vector3d& focus,
                                   const std::vector<double>& shares);

// As people order names with numbers: "p2" before "p10".
std::vector<int> ViewsInOrder(const Scene& scene);

}  // namespace color3d
