// How much moves from one frame to another. Stateless.
#pragma once

#include "core/base/image.h"

namespace color3d {

// The length that 3 % of the pixels of `flow` (px, 2 channels, not empty) exceed, in longer sides
// of the picture.
double MotionOf(const Image& flow);

}  // namespace color3d
