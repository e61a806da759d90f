// What moves on its own in a film, told from what only the camera moves (METHOD.md "Poses of
// films"): the residual of optical flow against the epipolar geometry of two frames. Pure
// functions, thread-safe.
#pragma once

#include <functional>
#include <memory>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"

namespace color3d {

inline constexpr int kMotionSidePx =
    480;  // longer side of the pictures that thresholds are made for

// The frames of one shot, in their order.
struct ShotFrames {
  int count = 0;
  // L in 0..100, 1 channel, all of one size. Called from several threads at once.
  std::function<std::shared_ptr<const Image>(int frame)> luminance;
};

// How the camera moved between two frames, by the simplest account that explains the flow.
enum class CameraMotion {
  kUnknown,  // too little texture, or nothing in common
  kStill,    // the flow of most is nearly nothing
  kTurn,     // a homography: a turn, a zoom, or a plane
  kMoved,    // a fundamental matrix
};

struct PairResidual {
  CameraMotion motion = CameraMotion::kUnknown;
  double background_px = 0.0;  // median length of the flow where it is sure
  // 1 channel, per pixel of `from`: px by which the flow departs from what the camera explains, as
  // a multiple of what noise may do there (1 px or more; more where there is little texture). Above
  // 1 it moves; < 0 where the flow is not sure (hidden in the other frame, or beyond its border).
  Image excess;
};

// Pictures as ShotFrames::luminance. Deterministic. Throws Error{kInvalidArgument} for other
// channels or unequal sizes.
PairResidual CompareFrames(const Image& from, const Image& to);

struct ShotMotion {
  // Median over pairs of frames, near and far ones, of PairResidual::background_px; 0 when there is
  // no pair that tells.
  double background_px = 0.0;
  int pairs = 0;  // that tell
  // Less than 0.3 px in nine tenths of the pairs.
  bool camera_stands_still = false;
  double moving_share = 0.0;  // the motion energy: share of all pixels that move on their own, 0..1
};

// Looks at a few pairs, near and far, only: whether the camera moves at all. moving_share stays 0.
ShotMotion MotionOfCamera(const ShotFrames& frames,
                          ThreadPool& pool,
                          const CancellationToken& cancel);

// The same, and hands every frame's regions over, in any order, from several threads, one after
// the other: 1 channel, 1 where most of the neighbours at distance 1, 2, 4 and 8 that tell say that
// something moves (grown by a few px), else 0. What moves along its epipolar line, straight towards
// or away with a camera that goes ahead, is not told from what stands nearer or farther away.
ShotMotion FindMovingRegions(const ShotFrames& frames,
                             ThreadPool& pool,
                             const CancellationToken& cancel,
                             const std::function<void(int frame, const Image& moving)>& on_frame);

// Where the largest region of what moves stands: its lowest row, as a share of the picture's height
// from its top; < 0 when less than 0.3 % of the picture moves. `moving` as FindMovingRegions says.
double FootRow(const Image& moving);

}  // namespace color3d
