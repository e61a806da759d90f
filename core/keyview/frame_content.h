// Detects frames that are unfit as key view by their pixels: blank, blurred, half covered, noise.
// Similarity of features is not sufficient, since those of a black frame are close to all others.
// Pure functions, thread-safe.
#pragma once

#include <string>
#include <vector>

#include "core/base/image.h"

namespace color3d {

struct FrameContent {
  double deviation = 0.0;    // standard deviation of L
  double detail = 0.0;       // mean magnitude of the Laplacian of L, sensitive to blur
  double structure = 0.0;    // share of 8x8 blocks that are not flat, 0..1
  double correlation = 0.0;  // correlation of neighbouring pixels, -1..1; about 0 for noise
};

// `luminance`: 1 channel, L in 0..100, all views of a scene at about the same size (some hundred
// px). Values that are not finite count as 0. Throws Error{kInvalidArgument} if it is empty.
FrameContent MeasureFrameContent(const Image& luminance);

// Returns for every frame the reason why it is unfit as key view, or an empty string. Thresholds
// are relative to the median of all frames, so that scenes in fog or with film grain keep their
// views. If every frame would be unfit, none is. `groups` (per frame; empty: one group): shots of a
// film, each with its own detail and structure. Half of the threshold of a group applies across
// groups, to exclude title cards.
std::vector<std::string> UnfitFrames(const std::vector<FrameContent>& frames,
                                     const std::vector<int>& groups = {});

}  // namespace color3d
