// Depth maps of splats are rough: neighbouring pixels blend other Gaussians. Pure, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d {

// `depth`: 1 channel, <= 0 where unknown. Medians of 5x5 known neighbours, twice, and then means of
// those neighbours that lie on the same surface; edges between surfaces stay where they are.
// Unknown pixels stay unknown.
Image SmoothDepth(const Image& depth);

}  // namespace color3d
