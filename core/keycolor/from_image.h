// The key view's colours from a coloured picture of it (STILL.md "Stage 1b"). L of the photo is
// always kept, only a and b are taken.
#pragma once

#include "core/base/image.h"

namespace color3d {

struct PaintedColor {
  Image ab;       // 2 channels, Lab units; 0 where nothing was painted
  Image painted;  // 1 channel: 1 or 0; empty: everything was
};

// Of a coloured picture of the key view, or of a part of it. `luminance`: 1 channel, L 0..100 of
// the key photo; `colored`: sRGB of the same size, 3 channels, or 4 of which what has an alpha of a
// half or less was not painted. Throws Error{kInvalidArgument} when sizes differ (both are named),
// when the picture has no colour or nothing was painted, or when its luminance does not correlate
// with the key view's (it shows something else).
PaintedColor KeyColorFromImage(const Image& luminance, const Image& colored);

}  // namespace color3d
