// Checks of the pictures that callers pass. Pure functions, thread-safe.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/image.h"

namespace color3d {

inline bool IsFinite(const Image& image) {
  return std::all_of(
      image.data.begin(), image.data.end(), [](float value) { return std::isfinite(value); });
}

// Throws Error{kInvalidArgument} if `image` is empty or has several channels. `consumer` begins the
// message: "the encoder".
inline void RequireLuminance(const Image& image, const char* consumer) {
  if (image.channels == 1 && !image.Empty()) return;
  throw InvalidArgument(
      "{} takes a picture with 1 channel (L), but got {} channels", consumer, image.channels);
}

}  // namespace color3d
