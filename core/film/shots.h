// Where a film is cut, and which of its frames show nothing of use, from small pictures of all
// frames (METHOD.md "Film"). Pure functions, thread-safe.
#pragma once

#include <vector>

#include "core/base/image.h"

namespace color3d {

inline constexpr int kShotThumbnailPx = 64;  // longer side of the small pictures

enum class FrameFault {
  kNone,
  kBlank,  // black, white or of one grey all over
  kAlien,  // it, or it and the next, unlike the frames around, which are alike: torn, or a flash
};

struct FilmShots {
  // Of each frame, counted from 0. A frame with a fault is a shot of its own, numbered behind the
  // others; the frames before and after it go on as one shot where they show the same.
  std::vector<int> shot;
  std::vector<FrameFault> fault;
  std::vector<int> cuts;  // the frames that begin the second shot and those after it, ascending
  int count = 0;
};

// `thumbnails`: 1 channel, L in 0..100, equal sizes, in the order of the film. Throws
// Error{kInvalidArgument} for other channels or sizes.
FilmShots FindShots(const std::vector<Image>& thumbnails);

// How unlike two such pictures are: the mean difference of their normalised L under the best shift
// by a few px; 0: the same but for exposure, near 1: nothing in common. For FindShots and its
// tests.
double Unlikeness(const Image& one, const Image& other);

}  // namespace color3d
