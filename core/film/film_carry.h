// Carries the colours of a film's key frames along the film by optical flow (FILM.md "Film").
// Each pixel is tracked back to its place in a key frame and takes the colour there, so that
// colours are resampled once only.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"
#include "core/carry/carry.h"
#include "core/film/reappearing_regions.h"

namespace color3d {

struct FilmKey {
  int frame = 0;
  CarriedColor color;  // of the working size; channels behind ab are carried like ab
};

struct FilmCarryOptions {
  // Forward-backward error at which confidence falls to a quarter.
  double cycle_tolerance_px = 2.0;  // 0.1..20
  // Mean difference of local contrast from which confidence falls, 0.05..2; it is 1/e at twice
  // that.
  double unlikeness = 0.4;
  // Motion (MotionOf, summed) after which tracks are registered against the key frame itself, and
  // local features look for lost pixels, since errors of single steps add up. Also done when a
  // tenth of the frame has been lost since the last time. 0: at each frame; 1: never.
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
  // L in 0..100, 1 channel, equal sizes. Called from several threads at once.
  std::function<std::shared_ptr<const Image>(int frame)> luminance;
  // Flow between a frame and the next one of its shot if it is known already. May be empty. Called
  // from several threads at once.
  std::function<std::shared_ptr<const FlowPair>(int earlier, int later)> flow;
  // Time of each frame, ascending within a shot; empty: frames are evenly spaced.
  std::vector<double> time_s = {};
};

// State of a walk away from a key frame.
struct FilmWalk {
  int key = 0;          // frame
  int direction = 1;    // 1 or -1
  int frame = 0;        // last frame passed to on_frame
  double moved = 0.0;   // motion since the last registration
  double wanted = 0.0;  // mean confidence below which tracks are registered again
  std::shared_ptr<const FilmTrack> track;  // to `frame`; null at the walk's end
};

// For resuming interrupted work.
struct FilmResume {
  std::vector<FilmWalk> walks;  // last ones of on_walk; they continue after their frame
  // Called before on_frame with the same frame, under the same lock. May be empty.
  std::function<void(const FilmWalk& walk)> on_walk;
};

// The key frames of a frame's shot that are nearest to it in time; -1 where there is none.
struct NearKeyFrames {
  int nearest = -1;
  int second = -1;
};
// Returns, for each frame, the nearest of the frames `keys`; of two at the same distance, the first
// in the list.
std::vector<NearKeyFrames> NearestKeyFrames(const FilmFrames& frames, const std::vector<int>& keys);

// Carries a key frame's colours into a frame that no walk reaches, e.g. after a cut: to the regions
// of the key frame that local features find there. Confidence is 0 elsewhere. `regions`: of the key
// frame. `frame`: as FilmFrames::luminance. Throws Error{kCancelled}.
CarriedColor CarryIntoReappearing(const FilmKey& key,
                                  const ReappearingRegions& regions,
                                  const Image& frame,
                                  const FilmCarryOptions& options,
                                  const CancellationToken& cancel);

using OnCarriedFrame = std::function<void(int frame, const CarriedColor& color)>;

// Receivers of carried colours. Called in any order, from several threads, one call at a time.
struct FilmCarrySinks {
  OnCarriedFrame on_frame;   // colours of the nearest key frame
  OnCarriedFrame on_second;  // colours of the second nearest, after all others; may be empty
};

// Carries into every frame of the shots with a key frame from the nearest one, and then, for
// `sinks.on_second`, into the frames of shots with several from the second nearest. Memory does not
// grow with the number of frames. Resumed walks give the same bits; key frames are passed again.
// Throws Error{kInvalidArgument} for keys that are no frames or are given twice, kCancelled.
void CarryAlongFilm(const FilmFrames& frames,
                    const std::vector<FilmKey>& keys,
                    const FilmCarryOptions& options,
                    ThreadPool& pool,
                    const CancellationToken& cancel,
                    const FilmCarrySinks& sinks,
                    const FilmResume& resume = {});

}  // namespace color3d
