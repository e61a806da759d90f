// Patch-based outpainting (STILL.md "Stage 1c"): a quadrant of the key view is placed in the
// opposite corner of a canvas of the same size, and its two open sides are extended by quilting
// (Efros & Freeman 2001). Every pixel is a copy with both its luminance and its chroma. Only small
// steps of shading between neighbouring patches are smoothed, equally in all three channels.
// Nothing is averaged. Pure function, thread-safe.
#pragma once

#include <cstdint>

#include "core/augment/generated_picture.h"
#include "core/base/cancellation.h"

namespace color3d {

// Minimum side of pictures for generation; smaller ones have too few patches.
inline constexpr int kMinGeneratedSidePx = 32;

enum class Quadrant { kUpperLeft, kUpperRight, kLowerLeft, kLowerRight };

// `lab`: 3 channels, Lab units, sides of at least kMinGeneratedSidePx. Weight 1 on the quadrant,
// kRearrangedWeight on added pixels. Throws Error{kInvalidArgument} for other pictures.
GeneratedPicture OutpaintQuadrant(const Image& lab,
                                  Quadrant quadrant,
                                  uint64_t seed,
                                  const CancellationToken& cancel);

}  // namespace color3d
