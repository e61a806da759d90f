// Alpha blending of depth-sorted splats in 16x16 tiles, and its adjoint (Kerbl et al. 2023, with
// the backward pass front to back). One vector register is a block of 4x4 pixels. Internal to the
// splat module; deterministic whatever the thread count.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/parallel.h"
#include "core/simd/plane_buffer.h"
#include "core/splat/raster/binning.h"
#include "core/splat/raster/projection.h"

namespace color3d {

// `color` has splats.channels channels (1..4) and the picture's size; `background` has as many
// numbers. `transmittance` (1 channel) may be null. `median_depth` (1 channel, may be null) gets
// the last channel's value of the splat at which transmittance falls below one half, 0 without one.
// `block_masks` gets the 4x4 blocks that each list entry touches, for RasterizeBackward.
void RasterizeForward(const SplatBuffer& splats,
                      const TileLists& lists,
                      const float* background,
                      ThreadPool& pool,
                      PlaneBuffer& color,
                      PlaneBuffer* transmittance,
                      PlaneBuffer* median_depth,
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
