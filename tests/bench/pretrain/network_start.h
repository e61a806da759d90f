// Initial weights of pre-training: random, or from an earlier run. Torch in the interface.
#pragma once

#include <torch/types.h>

#include <memory>
#include <vector>

#include "core/colorizer/model/named_tensors.h"
#include "core/encoder/convnext/convnext.h"
#include "core/weights/weight_map.h"
#include "tests/bench/pretrain/color_bins.h"

namespace color3d {

// He-scaled layers; the stem keeps the Gabor filters of the random features.
std::unique_ptr<ConvNext> NewEncoder(const ConvNextConfig& config, uint64_t seed);

// Returns the colours of `color_bins` [K,2] with their shares in `histogram` (a small one for
// missing colours). Throws Error{kInvalidArgument} if the array is missing or has another shape.
std::vector<ColorHistogram::Bin> BinsOf(const WeightMap& weights, const ColorHistogram& histogram);

// Copies weights into all tensors whose names start with "encoder." or "color_head.". Throws
// Error{kInvalidArgument} with the name of a weight that is missing, of another shape or not
// finite.
void CopyWeights(const WeightMap& weights, const NamedTensors& tensors);

}  // namespace color3d
