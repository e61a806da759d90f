// Motion between two frames. Stateless.
#pragma once

#include "core/base/image.h"

namespace color3d {

// Length that 3 % of the pixels of `flow` exceed, relative to the longer side of the picture.
// `flow`: 2 channels, px, not empty.
double MotionOf(const Image& flow);

// Position to which `flow` moves each pixel: 2 channels, px.
Image MovedPositions(Image flow);

}  // namespace color3d
