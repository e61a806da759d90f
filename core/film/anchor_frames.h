// Chooses the frames of a film that get colours of their own; other frames take theirs from these
// by optical flow (FILM.md "Film"). Their number depends on motion, not on frames per second.
#pragma once

#include <vector>

#include "core/base/cancellation.h"
#include "core/base/parallel.h"
#include "core/film/film_carry.h"

namespace color3d {

struct AnchorOptions {
  // MotionOf, summed over the steps between the frames of one anchor.
  double most_motion = 0.1;  // 0..1; 0: each frame is an anchor
  int most_frames = 12;      // 1..1000
  void Validate() const;     // throws Error{kInvalidArgument}
};

// Returns the middle frame of each run of frames of a shot, ascending. Every other frame belongs to
// the nearest anchor of its shot. Throws Error{kCancelled}.
std::vector<int> AnchorFrames(const FilmFrames& frames,
                              const AnchorOptions& options,
                              ThreadPool& pool,
                              const CancellationToken& cancel);

}  // namespace color3d
