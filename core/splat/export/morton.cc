#include "core/splat/export/morton.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace color3d {
namespace {

double SignedLog(double x) { return std::copysign(std::log1p(std::abs(x)), x); }

// Two zero bits before each bit.
uint64_t Spread(uint64_t x) {
  x = (x | x << 16u) & 0x0000ff0000ffULL;
  x = (x | x << 8u) & 0x00f00f00f00fULL;
  x = (x | x << 4u) & 0x0c30c30c30c3ULL;
  return (x | x << 2u) & 0x249249249249ULL;
}

}  // namespace

LogGrid LogGridOf(const std::vector<float>& position) {
  LogGrid grid;
  if (position.empty()) return grid;
  for (int k = 0; k < 3; ++k) {
    grid.low[k] = grid.high[k] = SignedLog(position[k]);
    for (size_t i = k; i < position.size(); i += 3) {
      grid.low[k] = std::min(grid.low[k], SignedLog(position[i]));
      grid.high[k] = std::max(grid.high[k], SignedLog(position[i]));
    }
  }
  grid.cell.resize(position.size());
  for (size_t i = 0; i < position.size(); ++i) {
    const double extent = grid.high[i % 3] - grid.low[i % 3];
    const double unit = extent > 0.0 ? (SignedLog(position[i]) - grid.low[i % 3]) / extent : 0.0;
    grid.cell[i] = static_cast<uint16_t>(std::lround(65535.0 * std::clamp(unit, 0.0, 1.0)));
  }
  return grid;
}

std::vector<uint32_t> MortonOrder(const LogGrid& grid) {
  std::vector<uint64_t> code(grid.cell.size() / 3);
  for (size_t i = 0; i < code.size(); ++i) {
    for (unsigned k = 0; k < 3; ++k) code[i] |= Spread(grid.cell[3 * i + k]) << k;
  }
  std::vector<uint32_t> order(code.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(
      order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return code[a] < code[b]; });
  return order;
}

}  // namespace color3d
