// Amount of motion between two frames. Stateless.
#pragma once

#include "core/base/image.h"

namespace color3d {

// Length that 3 % of the pixels of `flow` exceed, relative to the longer side of the picture.
// `flow`: 2 channels, px, not empty.
double MotionOf(const Image& flow);

}  // namespace color3d
