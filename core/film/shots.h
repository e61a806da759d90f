// Finds the cuts of a film and its useless frames from thumbnails of all frames (FILM.md "Film").
// Pure functions, thread-safe.
#pragma once

#include <vector>

#include "core/base/image.h"

namespace color3d {

inline constexpr int kShotThumbnailPx = 64;  // longer side of the thumbnails

enum class FrameFault {
  kNone,
  kBlank,  // uniformly black, white or grey
  kAlien,  // one or two frames between frames that are alike, but unlike them: torn, or a flash
};

struct FilmShots {
  // Number of each frame's shot, from 0. A frame with a fault is a shot of its own, numbered behind
  // the others; the frames around it are one shot if they show the same.
  std::vector<int> shot;
  std::vector<FrameFault> fault;
  std::vector<int> cuts;  // first frames of all shots but the first, ascending
  int count = 0;
};

// `thumbnails`: 1 channel, L in 0..100, equal sizes, in the order of the film. Throws
// Error{kInvalidArgument} for other channels or sizes.
FilmShots FindShots(const std::vector<Image>& thumbnails);

// Mean difference of the normalised L of two thumbnails under the best shift by a few px. 0: equal
// but for exposure; near 1: nothing in common. For FindShots and its tests.
double ShotDissimilarity(const Image& one, const Image& other);

}  // namespace color3d
