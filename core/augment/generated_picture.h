// A training picture for the colorizer, generated from the coloured key view (STILL.md "Stage
// 1c"). A plain value.
#pragma once

#include "core/base/image.h"

namespace color3d {

struct GeneratedPicture {
  Image lab;     // 3 channels, Lab units
  Image weight;  // 1 channel, 0..1: weight of each pixel in training
};

// Weight of pixels that are copied from the key view to other places.
inline constexpr float kRearrangedWeight = 0.5f;

}  // namespace color3d
