// The key view's colours from a coloured picture of it (METHOD.md "Stage 1b"). L of the photo is
// always kept, only a and b are taken.
#pragma once

#include "core/base/image.h"

namespace color3d {

// a, b (2 channels, Lab units) of a coloured picture of the key view. `luminance`: 1 channel, L
// 0..100 of the key photo; `colored`: 3 channels sRGB, of the same size. Throws
// Error{kInvalidArgument} when sizes differ (both are named), when the picture has no colour, or
// when its luminance does not correlate with the key view's (it shows something else).
Image KeyColorFromImage(const Image& luminance, const Image& colored);

}  // namespace color3d
