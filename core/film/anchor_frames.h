// Which frames of a film are coloured on their own, and which take their colours from those, by
// motion (METHOD.md "Film"): how many depends on how much moves, not on frames per second.
#pragma once

#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/film/film_carry.h"

namespace color3d {

struct AnchorOptions {
  // MotionOf each step, summed over the frames around one anchor, from first to last.
  double most_motion = 0.1;  // 0..1; 0: each frame is an anchor
  int most_frames = 12;      // 1..1000
  void Validate() const;     // throws Error{kInvalidArgument}
};

// The middle frame of each run of frames of one shot, ascending; each other frame belongs to the
// nearest anchor of its shot. Throws Error{kCancelled}.
std::vector<int> AnchorFrames(const FilmFrames& frames,
                              const AnchorOptions& options,
                              ThreadPool& pool,
                              const CancellationToken& cancel);

}  // namespace color3d
