// Removes flicker of exposure from a film (FILM.md "Film"): computes for each frame the monotone
// curve that maps its tones to those of the frames around it. Tones are compared along optical
// flow, so that moving objects do not count. Pure functions, thread-safe.
#pragma once

#include <vector>

#include "core/base/cancellation.h"
#include "core/base/image.h"
#include "core/base/parallel.h"

namespace color3d {

inline constexpr int kTonePicturePx = 112;  // longer side of the thumbnails

// Monotone map of L to L, 0..100, at evenly spread tones from 0 to 100. Empty: identity.
using ToneCurve = std::vector<float>;

struct SteadyTones {
  std::vector<ToneCurve> curves;  // of each frame
  // Mean difference in L between the same places of a frame and the next one of its shot.
  double flicker_before = 0.0;
  double flicker_after = 0.0;
};

// `pictures`: 1 channel, L in 0..100, equal sizes, in the order of the film. `shot`: of each
// picture; exposure is compared within a shot only. Throws Error{kInvalidArgument} for other
// channels, sizes or counts, Error{kCancelled}.
SteadyTones FindSteadyTones(const std::vector<Image>& pictures,
                            const std::vector<int>& shot,
                            ThreadPool& pool,
                            const CancellationToken& cancel);

// Applies the curve to a picture of L, 1 channel.
Image ApplyToneCurve(Image luminance, const ToneCurve& curve);

}  // namespace color3d
