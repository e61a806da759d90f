// Conversion of pictures to YUV. Pure functions.
#pragma once

#include <cstdint>

#include "core/base/image.h"
#include "core/base/parallel.h"

namespace color3d {

// A plane of bytes that the caller owns.
struct BytePlane {
  uint8_t* data = nullptr;
  int stride = 0;  // bytes between rows
};

// sRGB in 0..1 (3 channels, even sides) to BT.709 Y'CbCr of limited range: Y at full size; Cb, Cr
// for every 2x2 pixels, sited as is H.264's default: at the left pixel's centre, between the rows.
void YuvFromSrgb(const Image& srgb, BytePlane y, BytePlane cb, BytePlane cr, ThreadPool& pool);

}  // namespace color3d
