// Recolouring of a scene that is in colour: its key view is given as an edited version of itself.
#pragma once

#include "core/base/image.h"

namespace color3d {

// Returns a, b (2 channels, Lab units) of the key view after the edit; luminance remains the
// original's. `original_srgb`: the key photo as captured, `edited_srgb`: the edited picture (3
// channels, sRGB 0..1). `mask` (1 to 4 channels, or null: all) is white (mean over RGB above 0.5)
// where colour may change: outside, the original's chroma is kept exactly; inside, the edit fades
// in over the first 2 px. All have one size. Throws Error{kInvalidArgument} if sizes or channels
// differ, the mask is empty, the edit shows something else, or it changes no colour inside the
// mask.
Image KeyColorFromEdit(const Image& original_srgb, const Image& edited_srgb, const Image* mask);

// Returns the edited share of each pixel (1 channel, 0..1): 0 where the chroma changed by no more
// than rounding, 1 from twice that on. Both are a, b (2 channels, Lab units) of one size.
Image EditedShare(const Image& original_ab, const Image& edited_ab);

}  // namespace color3d
