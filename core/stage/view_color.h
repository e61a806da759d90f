// The colour of one view as it is delivered: carried, inferred and guessed colours fused. For
// colorize_views and whoever measures what it would deliver.
#pragma once

#include "core/carry/fusion.h"
#include "core/colorizer/colorizer.h"

namespace color3d {

// `luminance`: 1 channel, L 0..100; `carried`: of its size, confidence 0 where nothing was carried.
FusedColor ColorOfView(const Colorizer& colorizer,
                       const Image& luminance,
                       const CarriedColor& carried,
                       ThreadPool& pool,
                       const CancellationToken& cancel);

}  // namespace color3d
