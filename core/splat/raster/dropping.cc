#include <cmath>

#include "core/splat/raster/projection.h"

namespace color3d {
namespace {

// Evenly spread bits of a number (SplitMix64, Steele et al. 2014): the choice for a Gaussian
// depends on its index alone, not on who was asked before.
uint64_t Mixed(uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30u)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27u)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31u);
}

}  // namespace

void DropSplats(const SplatDropping& dropping, ThreadPool& pool, SplatBuffer& splats) {
  const auto threshold = static_cast<uint64_t>(dropping.rate * 4294967296.0);
  const auto gain = static_cast<float>(-std::log2(1.0 - dropping.rate));
  const uint64_t stream = Mixed(dropping.seed);
  pool.ForRanges(static_cast<int64_t>(splats.depth_key.size()),
                 [&](int64_t begin, int64_t end, int) {
                   for (int64_t i = begin; i < end; ++i) {
                     if (splats.depth_key[i] == 0) continue;
                     if (Mixed(stream ^ static_cast<uint64_t>(i)) >> 32u < threshold) {
                       splats.depth_key[i] = 0;
                     } else {
                       splats.rows[i * splats.row_floats + kLog2Opacity] += gain;
                     }
                   }
                 });
}

}  // namespace color3d
