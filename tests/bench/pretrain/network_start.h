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

// Colours of `color_bins` [K,2] with the shares that `histogram` counted (those that it lacks get a
// small one). Throws Error{kInvalidArgument} when the array is missing or misshapen.
std::vector<ColorHistogram::Bin> BinsOf(const WeightMap& weights, const ColorHistogram& histogram);

// Copies weights into all tensors whose names start with "encoder." or "color_head.". Throws
// Error{kInvalidArgument} naming what is missing, of another shape or not finite.
void CopyWeights(const WeightMap& weights, const NamedTensors& tensors);

}  // namespace color3d
