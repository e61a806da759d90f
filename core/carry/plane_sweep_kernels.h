// Kernels of the plane sweep, compiled once per instruction set (core/simd/instruction_set.h).
// Pure functions, thread-safe.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/image.h"

namespace color3d {

inline constexpr int kCensusRadius = 3;  // every second pixel of a 7x7 window
inline constexpr int kCostScale = 8;     // fixed point: parts of a bit of the census

// Census of every pixel, [y][x]: one bit of the lower 24 per pixel of the window that is darker
// than the centre. The highest bit is set where the value is unknown. Rows have `stride` words, a
// whole number of registers.
struct CensusImage {
  int width = 0;
  int height = 0;
  int stride = 0;
  std::vector<uint32_t> words;
};

// Census of `luminance` (1 channel). Borders repeat the outermost pixels. Pixels where `mask` (1
// channel, may be empty) is 0 are unknown.
CensusImage CensusOf(const Image& luminance, const Image& mask);

// Costs of one source at one plane, [y][x], rows of CensusImage::stride bytes: bits that differ
// between the census of the reference and that of the source warped by `homography` (row-major,
// from pixels of the reference to those of the source), kUnknownCost where either is unknown.
// `source_mask` may be empty. `source` has at least 2 x 2 pixels.
void MatchSource(const CensusImage& reference,
                 const Image& source,
                 const Image& source_mask,
                 const std::array<float, 9>& homography,
                 std::vector<uint8_t>* costs);

// Mean of the `kept` smallest of the costs of several sources, times kCostScale, for each element.
void MeanOfSmallest(const std::vector<std::vector<uint8_t>>& costs,
                    int kept,
                    std::vector<uint8_t>* mean);

// Costs of all planes at all pixels, [y][x][plane], times kCostScale.
struct CostVolume {
  int width = 0;
  int height = 0;
  int planes = 0;
  std::vector<uint8_t> cost;
};

// One direction of semi-global matching. The penalty of a change by one plane is `small_step`, by
// several planes `large_step` / (1 + |difference of luminance| / edge_contrast), both in bits.
struct PathPenalties {
  double small_step;
  double large_step;
  double edge_contrast;
};

// Adds the costs of the paths that arrive at each pixel from (x - dx, y - dy) to `sum`, laid out
// as the volume.
void AddPathCosts(const CostVolume& volume,
                  const Image& luminance,
                  const PathPenalties& penalties,
                  int dx,
                  int dy,
                  std::vector<int16_t>& sum);

}  // namespace color3d
