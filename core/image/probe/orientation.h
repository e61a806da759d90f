// EXIF orientation of a JPEG, PNG or TIFF. Plain C++, no codec. Pure functions, thread-safe.
#pragma once

#include <string>
#include <string_view>

#include "core/image/probe/probe.h"

namespace color3d {

// 1..8 as in EXIF 2.3 tag 274; 1 (as stored) when absent or nonsense. Safe on hostile input.
int ReadOrientation(std::string_view bytes);

// A copy of a TIFF whose orientation tag, if any, says 1: codecs differ in how they apply it.
std::string TiffAsStored(std::string_view bytes);

// True for the four orientations that swap width and height.
inline bool OrientationSwapsSides(int orientation) { return orientation >= 5; }

// Size of the picture as it is looked at, after orientation.
struct PictureSize {
  int width = 0;
  int height = 0;
};
PictureSize OrientedSize(const ImageInfo& info, int orientation);

}  // namespace color3d
