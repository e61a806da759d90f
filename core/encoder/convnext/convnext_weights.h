// Finds a ConvNeXt in a published state dict and reads its sizes from the shapes. No torch.
#pragma once

#include <string>

#include "core/encoder/convnext/convnext_config.h"
#include "core/weights/weight_map.h"

namespace color3d {

struct ConvNextWeights {
  ConvNextConfig config;
  WeightMap weights;  // names without prefix, as ConvNext takes them
  std::string description;
};

// True when the names are those of a ConvNeXt as its authors write them, plain or under
// "encoder.arch." (DDColor) or "encoder." (our own pre-trained files).
bool HoldsConvNext(const WeightMap& weights);

// Moves the ConvNeXt's arrays out of `weights`, drops its classifier ("head", "head_cls") and the
// norm of the pooled output, and gives taps that have no norm of their own (norm0..norm3, which
// only DDColor adds) one without scale and shift. What belongs to no ConvNeXt stays in `weights`
// when there is a prefix. Throws Error{kInvalidArgument} when there is none or its stem is of an
// unknown kind.
ConvNextWeights TakeConvNextWeights(WeightMap& weights);

}  // namespace color3d
