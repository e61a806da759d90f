// Matches of two photos by optical flow of their luminance: the same pixels for every method that
// colours the scene (METHOD.md "Metrics"). Pure, thread-safe.
#pragma once

#include <vector>

#include "core/base/image.h"
#include "core/metrics/consistency.h"

namespace color3d {

// Every `stride_px`-th pixel of every `stride_px`-th row whose flow ends in the other photo and
// agrees with the flow back. In rows from top to bottom. No matches in pictures that are too small
// for optical flow. Requires: 1 channel each, L 0..100. The second photo may have another size.
// Throws Error{kInvalidArgument} for other channels and for a stride below 1.
std::vector<PixelMatch> MatchByFlow(const Image& luminance,
                                    const Image& other_luminance,
                                    int stride_px);

}  // namespace color3d
