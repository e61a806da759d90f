// Separates moving objects in a film from the motion of the camera (DYNAMIC.md "Poses of films") by
// the residual of optical flow against the epipolar geometry of two frames. Pure functions,
// thread-safe.
#pragma once

#include <functional>
#include <memory>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"

namespace color3d {

inline constexpr int kMotionSidePx = 480;  // longer side of the pictures that the thresholds assume

// The frames of one shot, in order.
struct ShotFrames {
  int count = 0;
  // L in 0..100, 1 channel, all of one size. Called from several threads at once.
  std::function<std::shared_ptr<const Image>(int frame)> luminance;
};

// Motion of the camera between two frames: the simplest model that explains the flow.
enum class CameraMotion {
  kUnknown,  // too little texture, or nothing in common
  kStill,    // most pixels have nearly no flow
  kTurn,     // homography: a rotation, a zoom, or a planar scene
  kMoved,    // fundamental matrix
};

struct PairResidual {
  CameraMotion motion = CameraMotion::kUnknown;
  double background_px = 0.0;  // median length of the reliable flow
  // 1 channel, per pixel of `from`: residual of the flow against the model, divided by the noise
  // expected there (1 px or more, more where texture is weak). Above 1: moving. < 0: unreliable
  // flow (occluded, or beyond the border of the other frame).
  Image excess;
};

// Pictures as ShotFrames::luminance. Deterministic. Throws Error{kInvalidArgument} for other
// channels or unequal sizes.
PairResidual CompareFrames(const Image& from, const Image& to);

struct ShotMotion {
  // Median of PairResidual::background_px over near and far pairs of frames; 0 without a usable
  // pair.
  double background_px = 0.0;
  int pairs = 0;  // usable ones
  // Less than 0.3 px in nine tenths of the pairs.
  bool camera_stands_still = false;
  double moving_share = 0.0;  // motion energy: share of all pixels on moving objects, 0..1
};

// Measures the camera's motion from a few near and far pairs. Leaves moving_share at 0.
ShotMotion MeasureCameraMotion(const ShotFrames& frames,
                               ThreadPool& pool,
                               const CancellationToken& cancel);

// Also calls `on_frame` with the moving regions of each frame, in any order, from several threads,
// one call at a time: 1 channel, 1 where most of the usable neighbours at distance 1, 2, 4 and 8
// see motion (dilated by a few px), else 0. Motion along epipolar lines, as of objects ahead of a
// camera that drives forward, is not distinguished from depth.
ShotMotion FindMovingRegions(const ShotFrames& frames,
                             ThreadPool& pool,
                             const CancellationToken& cancel,
                             const std::function<void(int frame, const Image& moving)>& on_frame);

// Lowest row of the largest moving region, as a share of the picture's height from the top; < 0
// when less than 0.3 % of the picture moves. `moving`: as FindMovingRegions passes it.
double LowestMovingRow(const Image& moving);

}  // namespace color3d
