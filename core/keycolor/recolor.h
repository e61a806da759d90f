// Recolouring: the scene has colours, and the key view comes as an edited version of itself.
#pragma once

#include "core/base/image.h"

namespace color3d {

// a, b (2 channels, Lab units) of the key view after the edit; its luminance stays the original's.
// `original_srgb` is the key photo as captured, `edited_srgb` the edited picture (3 channels, sRGB
// 0..1). `mask` (1 to 4 channels, or null: all) is white, its mean over RGB above 0.5, where colour
// may change: outside, the original's chroma is kept exactly, inside, the edit fades in over the
// first 2 px. All have one size. Throws Error{kInvalidArgument} when sizes or channels differ, when
// the mask allows nothing, when the edit shows something else, or when it changes no colour inside
// the mask.
Image KeyColorFromEdit(const Image& original_srgb, const Image& edited_srgb, const Image* mask);

}  // namespace color3d
