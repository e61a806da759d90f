// Converts CLIP's weights from any known layout to OpenAI's names. No torch. For this folder only.
#pragma once

#include "core/weights/weight_map.h"

namespace color3d {

// Returns whether the names are those of a CLIP in the layout of OpenAI (and open_clip) or Hugging
// Face.
bool HoldsClip(const WeightMap& weights);

// Converts Hugging Face's layout to OpenAI's: stacks q, k and v, transposes projections and drops
// buffers. From OpenAI's layout it only drops buffers. Arrays of unknown names are kept, so that
// the network lists them. Throws Error{kInvalidArgument} if the image tower is a ResNet.
WeightMap OpenAiClipWeights(WeightMap weights);

}  // namespace color3d
