// A random ConvNeXt with features similar to a scattering transform (Bruna & Mallat 2013). Start
// and baseline of pre-training. Deterministic: own generator, no torch.
#pragma once

#include <cstdint>

#include "core/encoder/convnext/convnext_config.h"
#include "core/weights/weight_map.h"

namespace color3d {

// Complete set of weights for `config`, named as in the published ConvNeXt state dicts. The stem
// holds Gabor and difference-of-Gaussians filters, depth-wise filters are smooth random low- and
// band-passes, 1x1 layers are random with orthogonal rows.
WeightMap RandomFeatureWeights(const ConvNextConfig& config, uint64_t seed);

}  // namespace color3d
