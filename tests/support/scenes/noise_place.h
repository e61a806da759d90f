// Pictures of places that local features distinguish.
#pragma once

#include <cstdint>

#include "core/base/image.h"
#include "core/base/random.h"
#include "core/image/codec.h"

namespace color3d {

// Picture of the place `seed`, shifted by `from` px (at most 36): smooth noise, 0.2 to 0.8, 1
// channel.
inline Image NoisePlace(uint64_t seed, int width, int height, int from) {
  constexpr int kGrainPx = 4;
  Random random(seed);
  Image coarse(width / kGrainPx + 10, height / kGrainPx, 1);
  for (float& value : coarse.data) value = static_cast<float>(0.2 + 0.6 * random.NextUniform());
  const Image fine = Resize(coarse, coarse.width * kGrainPx, height);
  Image part(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) part.At(0, y, x) = fine.At(0, y, x + from);
  }
  return part;
}

}  // namespace color3d
