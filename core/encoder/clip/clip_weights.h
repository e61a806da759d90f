// CLIP's weights under OpenAI's names, whatever the file's own layout. No torch. For this folder
// only.
#pragma once

#include "core/weights/weight_map.h"

namespace color3d {

// True when the names are those of a CLIP in OpenAI's layout (also open_clip's) or Hugging Face's.
bool HoldsClip(const WeightMap& weights);

// Hugging Face's names to OpenAI's: q, k and v are stacked, projections transposed, buffers
// dropped; OpenAI's layout is only rid of its buffers. Arrays of unknown names stay as they are,
// for the network to list. Throws Error{kInvalidArgument} when the image tower is a ResNet.
WeightMap OpenAiClipWeights(WeightMap weights);

}  // namespace color3d
