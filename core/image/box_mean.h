// Means over square windows. Pure, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d {

// Mean of each channel over windows of (2 radius + 1)^2 pixels, clipped at the borders. radius >=
// 0.
Image BoxMean(const Image& image, int radius);

}  // namespace color3d
