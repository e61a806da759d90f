// Resizing of values of which some are surer than others. Pure, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d {

// `values` (any channels) resized so that each source pixel counts by its `weight` (1 channel of
// the same size, >= 0): what is not known does not leak into what is. Where no weight reaches a
// pixel it is resized plainly.
Image ResizeWeighted(const Image& values, const Image& weight, int width, int height);

}  // namespace color3d
