// Flicker of exposure taken out of a film (METHOD.md "Film"): for each frame the monotone curve
// that gives its tones what the same places have in the frames around it. What moves, comes or goes
// does not count: tones are compared where optical flow finds the same place again. Pure functions,
// thread-safe.
#pragma once

#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"

namespace color3d {

inline constexpr int kTonePicturePx = 112;  // longer side of the small pictures

// L to L, 0..100, at tones that are evenly spread from 0 to 100; never falls. Empty: nothing
// changes.
using ToneCurve = std::vector<float>;

struct SteadyTones {
  std::vector<ToneCurve> curves;  // of each frame
  // L by which the same places differ from a frame to the next of its shot, in the mean.
  double flicker_before = 0.0;
  double flicker_after = 0.0;
};

// `pictures`: 1 channel, L in 0..100, equal sizes, in the order of the film; `shot` of each:
// exposure is compared within a shot only. Throws Error{kInvalidArgument} for other channels, sizes
// or counts, Error{kCancelled}.
SteadyTones FindSteadyTones(const std::vector<Image>& pictures,
                            const std::vector<int>& shot,
                            ThreadPool& pool,
                            const CancellationToken& cancel);

// The picture (1 channel, L) under the curve.
Image Toned(Image luminance, const ToneCurve& curve);

}  // namespace color3d
