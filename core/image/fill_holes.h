// Smooth filling of what a warp left open. Pure function, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d {

// Replaces the pixels of `image` (any channels) whose `known` (1 channel, same size) is 0 by a
// smooth continuation of the others (push-pull pyramid, Gortler et al. 1996). Nothing changes where
// `known` is above 0, or when it is 0 everywhere.
void FillHoles(const Image& known, Image* image);

}  // namespace color3d
