// Smooths depth maps of splats, which are noisy because neighbouring pixels blend different
// Gaussians. Pure functions, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d {

// `depth`: 1 channel, <= 0 where unknown. Applies a median over 5x5 known neighbours twice, then a
// mean over neighbours on the same surface. Keeps edges between surfaces and unknown pixels.
Image SmoothDepth(const Image& depth);

}  // namespace color3d
