// Dense optical flow (OpenCV's DIS inside, never in this interface). Pure functions, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d {

// Displacement in px, 2 channels (x, y), such that from(p) looks like to(p + flow(p)). Both
// pictures 1 channel, L 0..100, equal sizes. Zero where the pictures are smaller than the method's
// patches. Throws Error{kInvalidArgument} for other channels or sizes.
Image DenseFlow(const Image& from, const Image& to);

}  // namespace color3d
