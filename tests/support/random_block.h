// A block of random parameters, for tests of row-wise code.
#pragma once

#include <cstdint>

#include "core/base/random.h"
#include "core/splat/model/parameter_block.h"

namespace color3d {

inline constexpr int kBlockRows = kColorRow + 1;
inline constexpr int kBlockCount = 53;  // not a multiple of the vector

// kBlockRows x kBlockCount normal numbers times `scale`.
inline ParameterBlock RandomBlock(uint64_t seed, double scale) {
  Random random(seed);
  ParameterBlock p(kBlockRows, kBlockCount);
  for (int r = 0; r < kBlockRows; ++r) {
    for (int i = 0; i < kBlockCount; ++i) {
      p.Row(r)[i] = static_cast<float>(scale * random.NextNormal());
    }
  }
  return p;
}

}  // namespace color3d
