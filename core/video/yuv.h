// Pictures as movies keep them. Pure functions.
#pragma once

#include <cstdint>

#include "core/base/image.h"
#include "core/base/parallel.h"

namespace color3d {

// A plane of bytes in somebody's memory.
struct BytePlane {
  uint8_t* data = nullptr;
  int stride = 0;  // bytes from a row to the next
};

// sRGB in 0..1 (3 channels, even sides) as BT.709 Y'CbCr of limited range: Y at full size; Cb, Cr
// for every 2x2 pixels, sited as H.264 has them unless told otherwise: at the left pixel's middle,
// between the rows.
void YuvFromSrgb(const Image& srgb, BytePlane y, BytePlane cb, BytePlane cr, ThreadPool& pool);

}  // namespace color3d
