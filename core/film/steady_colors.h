// Colours of neighbouring frames averaged along motion, so that what is decided for each frame anew
// does not flicker (METHOD.md "Film"). Stateless.
#pragma once

#include <memory>
#include <vector>

#include "core/base/image.h"
#include "core/film/film_carry.h"

namespace color3d {

struct SteadyColorsOptions {
  int reach = 6;             // frames to either side that have a say, 0..32
  double persistence = 0.8;  // a frame's weight against that of the one before it on the way, 0..1
  void Validate() const;     // throws Error{kInvalidArgument}
};

struct FrameInMotion {
  const Image* ab = nullptr;  // 2 channels, Lab units
  // Flow between the frame before it and this one; null where that one has no say, nor those before
  // it: where a shot begins, or the frames that another key frame colours.
  std::shared_ptr<const FlowPair> flow_from_last;
};

// The colours of frame `index`: of each pixel and the places that it is followed to, as long as
// flow there and back agree. `frames`: neighbours of one size in their order.
Image SteadyColors(const std::vector<FrameInMotion>& frames,
                   int index,
                   const SteadyColorsOptions& options = {});

}  // namespace color3d
