// Smooth filling of holes left by a warp. Pure function, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d {

// Replaces the pixels of `image` (any channels) whose `known` (1 channel, same size) is 0 by a
// smooth continuation of the others (push-pull pyramid, Gortler et al. 1996). Pixels with `known`
// above 0 are unchanged, and all pixels if it is 0 everywhere.
void FillHoles(const Image& known, Image* image);

}  // namespace color3d
