// Weights of small networks for FID and LPIPS: published names, channels divided by 16, values by
// name (tests/support/networks/named_values.h). Pure functions.
#pragma once

#include "core/weights/weight_map.h"

namespace color3d {

// `classes`: of the final layer; 1008 marks the network of the original FID.
WeightMap SmallInceptionWeights(int classes);
WeightMap SmallAlexNetWeights();
WeightMap SmallVggWeights();
// The linear layers of LPIPS. `backbone`: "alex" or "vgg".
WeightMap SmallLpipsLinearWeights(const char* backbone);

}  // namespace color3d
