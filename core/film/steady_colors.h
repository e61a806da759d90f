// Averages the colours of neighbouring frames along optical flow, so that colours inferred frame by
// frame do not flicker (FILM.md "Film"). Stateless.
#pragma once

#include <memory>
#include <vector>

#include "core/base/image.h"
#include "core/film/film_carry.h"

namespace color3d {

struct SteadyColorsOptions {
  int reach = 6;             // frames to either side that count, 0..32
  double persistence = 0.8;  // factor of a frame's weight per step away, 0..1
  void Validate() const;     // throws Error{kInvalidArgument}
};

struct MovingFrame {
  const Image* ab = nullptr;  // 2 channels, Lab units
  // Flow between the frame before it and this one. Null where the earlier frames do not count: at
  // the beginning of a shot, or of the frames of another key frame.
  std::shared_ptr<const FlowPair> flow_from_last;
};

// Returns the colours of frame `index`, averaged over each pixel's track as long as forward and
// backward flow agree. `frames`: neighbours of one size, in order.
Image SteadyColors(const std::vector<MovingFrame>& frames,
                   int index,
                   const SteadyColorsOptions& options = {});

}  // namespace color3d
