// Patch-based outpainting (STILL.md "Stage 1c"): a quadrant of the key view is put into the
// opposite corner of a canvas of the key view's size, and its two outer sides are extended by
// quilting (Efros & Freeman 2001). Every pixel is a copy whose chroma travels with its own
// luminance; only small steps of shading between neighbouring patches are evened out, in all three
// channels alike. Nothing is averaged. Pure function of its arguments, thread-safe.
#pragma once

#include <cstdint>

#include "core/augment/generated_picture.h"
#include "core/base/cancellation.h"

namespace color3d {

// Smaller pictures, each way, hold too few patches; nothing is generated from or taken for them.
inline constexpr int kMinGeneratedSidePx = 32;

enum class Quadrant { kUpperLeft, kUpperRight, kLowerLeft, kLowerRight };

// `lab`: 3 channels, Lab units, at least kMinGeneratedSidePx each way. Weight 1 on the quadrant,
// kRearrangedWeight on what was added. Throws Error{kInvalidArgument} on another picture.
GeneratedPicture OutpaintQuadrant(const Image& lab,
                                  Quadrant quadrant,
                                  uint64_t seed,
                                  const CancellationToken& cancel);

}  // namespace color3d
