// Quantized positions and Morton order of Gaussians, for compression. Pure functions.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace color3d {

// Positions as 16-bit numbers within the box of sign(x) ln(1 + |x|).
struct LogGrid {
  std::array<double, 3> low = {};  // of the logarithms
  std::array<double, 3> high = {};
  std::vector<uint16_t> cell;  // 3 a Gaussian
};

// Requires 3 finite numbers for each Gaussian.
LogGrid LogGridOf(const std::vector<float>& position);

// Indices of Gaussians in an order that keeps spatial neighbours close; ties by index.
std::vector<uint32_t> MortonOrder(const LogGrid& grid);

}  // namespace color3d
