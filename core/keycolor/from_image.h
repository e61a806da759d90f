// Colours of the key view from a coloured picture of it (STILL.md "Stage 1b"). Only a and b are
// used; L remains that of the photo.
#pragma once

#include "core/base/image.h"

namespace color3d {

struct PaintedColor {
  Image ab;       // 2 channels, Lab units; 0 where unpainted
  Image painted;  // 1 channel: 1 where painted, else 0; empty: all painted
};

// Returns the colours of a coloured picture of the key view or of a part of it. `luminance`: 1
// channel, L 0..100 of the key photo; `colored`: sRGB of the same size, 3 channels, or 4, where
// pixels with an alpha of at most 0.5 are unpainted. Throws Error{kInvalidArgument} naming both
// sizes if they differ, if the picture has no colour or no painted pixel, or if its luminance does
// not correlate with the key view's (it shows something else).
PaintedColor KeyColorFromImage(const Image& luminance, const Image& colored);

}  // namespace color3d
