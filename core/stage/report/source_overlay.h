// Sources of the colour of a view as shades over its photo. For the report stage only.
#pragma once

#include "core/base/image.h"

namespace color3d {

// Seen pixels are teal, inferred ones amber, guessed ones purple and hatched, for colour-blind
// readers. `photo`: 3 channels, sRGB. `provenance`: 3
// channels, shares of guessed, seen and inferred. Returns 3 channels, sRGB, of the size of the
// photo.
Image ShadeBySource(const Image& photo, const Image& provenance);

}  // namespace color3d
