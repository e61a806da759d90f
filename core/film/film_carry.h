// Colour of a film's key frames carried along the film by motion (METHOD.md "Film"): every pixel is
// followed back to where it lies in a key frame, whose own colours are taken there, so that nothing
// is blurred by being resampled again and again.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"
#include "core/carry/carry.h"
#include "core/film/found_again.h"

namespace color3d {

struct FilmKey {
  int frame = 0;
  CarriedColor color;  // of the working size; further channels are carried like the two of ab
};

struct FilmCarryOptions {
  // From a pixel to the key frame and back again: distance at which confidence falls to a quarter.
  double cycle_tolerance_px = 2.0;  // 0.1..20
  // Mean difference of the local contrast of both places from which confidence falls, 0.05..2; to
  // 1/e at twice that.
  double unlikeness = 0.4;
  // Steps from frame to frame add up to errors. When so much has moved (MotionOf, summed) since
  // that was done last, and while a tenth of the frame has been lost since, what they led to is
  // registered against the key frame itself, and local features look for what they have lost.
  // 0: at each frame; 1: never.
  double correct_after = 0.05;
  void Validate() const;  // throws Error{kInvalidArgument}
  bool operator==(const FilmCarryOptions&) const = default;
};

// Optical flow between two frames, px.
struct FlowPair {
  Image forth;  // from the earlier one to the later
  Image back;
};

struct FilmFrames {
  std::vector<int> shot;  // of each frame; colours are carried within a shot only
  // L in 0..100, 1 channel, all of one size. Called from several threads at once.
  std::function<std::shared_ptr<const Image>(int frame)> luminance;
  // Between a frame and the next one of its shot, where it is known already. May be empty. Called
  // from several threads at once.
  std::function<std::shared_ptr<const FlowPair>(int earlier, int later)> flow;
  // When each frame is shown, ascending within a shot; empty: one after the other.
  std::vector<double> time_s = {};
};

// How far the walk away from a key frame is.
struct FilmWalk {
  int key = 0;                             // frame
  int direction = 1;                       // 1 or -1
  int frame = 0;                           // the last one that was handed over
  double moved = 0.0;                      // since it was corrected in its turn
  double wanted = 0.0;                     // mean confidence below which it is corrected anyway
  std::shared_ptr<const FilmTrack> track;  // to it; null at the walk's end
};

// For work that may be interrupted.
struct FilmResume {
  std::vector<FilmWalk> walks;  // as on_walk told them last: they go on behind their frame
  // Called before on_frame with the same frame, under the same lock. May be empty.
  std::function<void(const FilmWalk& walk)> on_walk;
};

// The key frames of a frame's shot that are nearest to it in time; -1 where there is none.
struct NearKeyFrames {
  int nearest = -1;
  int second = -1;
};
// Of each frame, among `keys` (frames; of two as near the one given first).
std::vector<NearKeyFrames> NearestKeyFrames(const FilmFrames& frames, const std::vector<int>& keys);

// What a frame that nothing leads to from a key frame, as behind a cut, shows of it as far as local
// features find that; confidence 0 elsewhere. `again`: of the key frame; `frame`: as FilmFrames'
// luminance. Throws Error{kCancelled}.
CarriedColor CarryFoundAgain(const FilmKey& key,
                             const FoundAgain& again,
                             const Image& frame,
                             const FilmCarryOptions& options,
                             const CancellationToken& cancel);

using OnCarriedFrame = std::function<void(int frame, const CarriedColor& color)>;

// Colours every frame of the shots that have a key frame from the nearest of them, and hands it to
// `on_frame` in any order, from several threads, one after the other. Frames of other shots are not
// handed over. When all are there, `on_second`, unless it is empty, is handed what the second
// nearest key frame gives those of shots with two or more. Memory does not grow with the number of
// frames. What comes of resumed walks is the same to the bit; key frames are handed over again.
// Throws Error{kInvalidArgument} for keys that are no frames or are given twice, kCancelled.
void CarryAlongFilm(const FilmFrames& frames,
                    const std::vector<FilmKey>& keys,
                    const FilmCarryOptions& options,
                    ThreadPool& pool,
                    const CancellationToken& cancel,
                    const OnCarriedFrame& on_frame,
                    const FilmResume& resume = {},
                    const OnCarriedFrame& on_second = {});

}  // namespace color3d
