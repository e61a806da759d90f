// Where a view's colour comes from, as shades over its photo. For the report stage only.
#pragma once

#include "core/base/image.h"

namespace color3d {

// `photo`: 3 channels, sRGB. `provenance`: 3 channels, shares of guessed, seen and inferred. What
// was seen is the photo in grey, what was inferred has a blue tint, what was guessed is hatched in
// orange: told apart by lightness and pattern, too, for people who do not tell colours apart.
// Returns 3 channels, sRGB, of the photo's size.
Image ShadeBySource(const Image& photo, const Image& provenance);

}  // namespace color3d
