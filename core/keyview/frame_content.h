// Frames that must never become the key view, told by their pixels: blank, blurred, half covered,
// noise. Similarity to the other views cannot be relied on for that: features of a black frame are
// not far from everything else's. Pure functions, thread-safe.
#pragma once

#include <string>
#include <vector>

#include "core/base/image.h"

namespace color3d {

struct FrameContent {
  double deviation = 0.0;    // standard deviation of L
  double detail = 0.0;       // mean magnitude of the Laplacian, L: what blur takes away first
  double structure = 0.0;    // share of 8x8 blocks that are not flat, 0..1
  double correlation = 0.0;  // of neighbouring pixels, -1..1; about 0 for noise
};

// `luminance`: 1 channel, L in 0..100, all views of a scene at about the same size (some hundred
// px). Values that are not finite count as 0. Throws Error{kInvalidArgument} when it is empty.
FrameContent MeasureFrameContent(const Image& luminance);

// For every frame why it cannot be the key view, empty when it can. Judged against the median of
// all frames, so that a scene in fog or of film grain keeps its views; when every frame would be
// unfit, none is. `groups` (of each frame; empty: one group): the shots of a film, each of which
// has detail and structure of its own; half of what is asked of one group is asked of all alike, or
// title cards would be fit.
std::vector<std::string> UnfitFrames(const std::vector<FrameContent>& frames,
                                     const std::vector<int>& groups = {});

}  // namespace color3d
