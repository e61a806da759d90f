// EXIF orientation of a picture. Plain C++, no codec. Pure functions, thread-safe.
#pragma once

#include <string_view>

#include "core/image/probe/probe.h"

namespace color3d {

// 1..8 as in EXIF 2.3 tag 274; 1 (as stored) if absent or invalid, and for HEIC, whose size is
// given after orientation. For TIFFs, that of the selected page. Safe on hostile input.
int ReadOrientation(std::string_view bytes);

// Returns true for the four orientations that swap width and height.
inline bool OrientationSwapsSides(int orientation) { return orientation >= 5; }

// Size of the picture after orientation.
struct PictureSize {
  int width = 0;
  int height = 0;
};
PictureSize OrientedSize(const ImageInfo& info, int orientation);

}  // namespace color3d
