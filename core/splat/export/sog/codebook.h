// Scalar and vector quantization: up to 256 levels for single values, a palette for rows. Least
// squared error by Lloyd's iterations; the result does not depend on the number of threads.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/parallel.h"

namespace color3d {

// Immutable after construction, so safe to share between threads.
class Codebook {
 public:
  // Requires finite values; none give zeros. Uses 2 <= count <= 256 of the levels, the rest repeat
  // the last one. Up to `count` different values are kept exactly.
  explicit Codebook(std::vector<float> values, int count = 256);
  const std::array<float, 256>& levels() const { return levels_; }  // ascending
  uint8_t Nearest(float value) const;

 private:
  std::array<float, 256> levels_ = {};
  std::array<float, 255> bounds_ = {};  // between neighbouring levels
};

struct Palette {
  std::vector<float> rows;       // size x width
  std::vector<uint16_t> labels;  // index of the palette row of each input row
};

// Requires finite rows of `width` >= 1 numbers; returns 1 <= size <= 65536 rows. Rows are clustered
// coarsely, then within each cluster: time grows with the square root of `size`.
Palette MakePalette(const std::vector<float>& rows, int width, int size, ThreadPool& pool);

}  // namespace color3d
