// 8-bit sRGB of Lab for pictures that are shown while somebody paints. Pure, thread-safe.
#pragma once

#include <cstdint>

namespace color3d {

// `rgb`: 3 bytes for each of `count` pixels. As SrgbFromLab (lab.h) rounded to 8 bits, but for one
// level here and there.
void QuickSrgbFromLab(const float* l, const float* a, const float* b, int64_t count, uint8_t* rgb);

}  // namespace color3d
