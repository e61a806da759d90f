// Few numbers that stand for many: up to 256 levels for single values, a palette for rows. Least
// squared error by Lloyd's iterations, the same for the same input whatever the number of threads.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/parallel.h"

namespace color3d {

// Immutable after construction, so safe to share between threads.
class Codebook {
 public:
  // Finite values; none at all gives zeros. 2 <= count <= 256 of the levels are used, the rest
  // repeat the last. Up to `count` different values are kept as they are.
  explicit Codebook(std::vector<float> values, int count = 256);
  const std::array<float, 256>& levels() const { return levels_; }  // ascending
  uint8_t Nearest(float value) const;

 private:
  std::array<float, 256> levels_ = {};
  std::array<float, 255> bounds_ = {};  // between neighbouring levels
};

struct Palette {
  std::vector<float> rows;       // size x width
  std::vector<uint16_t> labels;  // a row of it for each row that went in
};

// `rows` holds finite rows of `width` >= 1 numbers; 1 <= size <= 65536 rows come back. Rows are
// clustered coarsely, and then within each cluster: time grows with the square root of `size`.
Palette MakePalette(const std::vector<float>& rows, int width, int size, ThreadPool& pool);

}  // namespace color3d
