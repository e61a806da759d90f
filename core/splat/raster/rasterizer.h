// Alpha blending of depth-sorted splats in 16x16 tiles, and its adjoint (Kerbl et al. 2023, with
// the backward pass front to back). One vector register is a block of 4x4 pixels. Internal to the
// splat module; deterministic for every thread count.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/parallel.h"
#include "core/simd/plane_buffer.h"
#include "core/splat/raster/binning.h"
#include "core/splat/raster/projection.h"

namespace color3d {

// All planes have the picture's size; those of one channel may be null.
struct RasterizedPlanes {
  PlaneBuffer& color;                    // splats.channels channels, 1..4
  PlaneBuffer* transmittance = nullptr;  // 1 channel
  // 1 channel: the last channel's value of the splat at which transmittance falls below one half, 0
  // without one.
  PlaneBuffer* median_depth = nullptr;
};

// `background` has one number per channel. `block_masks` gets the 4x4 blocks that each list entry
// touches, for RasterizeBackward.
void RasterizeForward(const SplatBuffer& splats,
                      const TileLists& lists,
                      const float* background,
                      ThreadPool& pool,
                      const RasterizedPlanes& planes,
                      std::vector<uint16_t>& block_masks);

// `d_color` is dL/d(color); outside of the picture it must be zero. Channels 1..3. Fills one row of
// GradientRowFloats(channels) per pair (columns: SplatGradientColumn).
void RasterizeBackward(const SplatBuffer& splats,
                       const TileLists& lists,
                       const std::vector<uint16_t>& block_masks,
                       const PlaneBuffer& color,
                       const PlaneBuffer& d_color,
                       ThreadPool& pool,
                       AlignedFloats& pair_gradient);

}  // namespace color3d
