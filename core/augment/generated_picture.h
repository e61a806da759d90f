// One more training picture for the colorizer, made from the coloured key view (STILL.md
// "Stage 1c"). A plain value.
#pragma once

#include "core/base/image.h"

namespace color3d {

struct GeneratedPicture {
  Image lab;     // 3 channels, Lab units
  Image weight;  // 1 channel, 0..1: how far each pixel's colour is to be learnt
};

// Of pixels that are copies of the key view's, but lie where they do by our own arrangement.
inline constexpr float kRearrangedWeight = 0.5f;

}  // namespace color3d
