// Luminance relative to its surroundings, by which places of different exposure are compared (FILM.md "Carrying by
// motion"). Pure, thread-safe.
#pragma once

#include "core/base/image.h"

namespace color3d {

// Difference of local contrast from which a place is no longer like another one.
inline constexpr double kUnlikeness = 0.4;

// (L - mean) / deviation over 15 px, independent of exposure and contrast. `luminance`: 1 channel, L 0..100.
Image LocalContrast(const Image& luminance);

}  // namespace color3d
