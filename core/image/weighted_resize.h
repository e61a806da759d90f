// Resizing weighted by confidence. Pure, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d {

// Resizes `values` (any channels) so that each source pixel counts by its `weight` (1 channel of
// the same size, >= 0): unknown pixels do not leak into known ones. Pixels without any weight are
// resized without weights.
Image ResizeWeighted(const Image& values, const Image& weight, int width, int height);

}  // namespace color3d
