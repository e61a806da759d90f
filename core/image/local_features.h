// A few hundred local features of a picture, to find photos of a scene that overlap. OpenCV inside,
// never in this interface. Pure function, thread-safe.
#pragma once

#include <vector>

#include "core/base/image.h"

namespace color3d {

// Row i of `descriptors`, kDimensions floats, is feature i; rows have unit length.
struct LocalFeatures {
  static constexpr int kDimensions = 128;
  std::vector<float> descriptors;
  std::vector<float> positions;  // x, y of feature i from the picture's centre, px
  int side_px = 0;               // the picture's longer side
  int count() const { return static_cast<int>(descriptors.size()) / kDimensions; }
};

// SIFT (Lowe 2004) of the first channel, 0..1, with the square roots of L1-normalised descriptors
// (RootSIFT, Arandjelovic & Zisserman 2012): the `max_count` features of the strongest contrast,
// strongest first, none below `least_contrast` (as OpenCV's SIFT counts it). Pictures without
// structure or smaller than 16 px have none. Throws Error{kInvalidArgument} for an empty picture or
// max_count < 1.
LocalFeatures DetectLocalFeatures(const Image& gray, int max_count, double least_contrast = 0.04);

}  // namespace color3d
