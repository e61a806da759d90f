#include <cmath>

#include "core/base/random.h"
#include "core/splat/raster/projection.h"

namespace color3d {

// The decision for a Gaussian depends on its index alone, not on the order of calls.
void DropSplats(const SplatDropping& dropping, ThreadPool& pool, SplatBuffer& splats) {
  const auto threshold = static_cast<uint64_t>(dropping.rate * 4294967296.0);
  const auto gain = static_cast<float>(-std::log2(1.0 - dropping.rate));
  const uint64_t stream = MixedBits(dropping.seed);
  pool.ForRanges(static_cast<int64_t>(splats.depth_key.size()),
                 [&](int64_t begin, int64_t end, int) {
                   for (int64_t i = begin; i < end; ++i) {
                     if (splats.depth_key[i] == 0) continue;
                     if (MixedBits(stream ^ static_cast<uint64_t>(i)) >> 32u < threshold) {
                       splats.depth_key[i] = 0;
                     } else {
                       splats.rows[i * splats.row_floats + kLog2Opacity] += gain;
                     }
                   }
                 });
}

}  // namespace color3d
