// Finds a ConvNeXt in a published state dict and derives its sizes from the shapes. No torch.
#pragma once

#include <string>

#include "core/encoder/convnext/convnext_config.h"
#include "core/weights/weight_map.h"

namespace color3d {

struct ConvNextWeights {
  ConvNextConfig config;
  WeightMap weights;  // names without prefix, as ConvNext expects
  std::string description;
};

// Returns whether the names are those of a ConvNeXt in its authors' layout, plain or under
// "encoder.arch." (DDColor) or "encoder." (our own pre-trained files).
bool HoldsConvNext(const WeightMap& weights);

// Moves the ConvNeXt's arrays out of `weights`, drops its classifier ("head", "head_cls") and the
// norm of the pooled output, and adds norms without scale and shift to taps that lack them
// (norm0..norm3, which only DDColor has). With a prefix, other arrays stay in `weights`. Throws
// Error{kInvalidArgument} if there is no ConvNeXt or its stem is of an unknown kind.
ConvNextWeights TakeConvNextWeights(WeightMap& weights);

}  // namespace color3d
