// Pre-trained weights that are part of the program. CARD.md beside this file describes their
// training and accuracy.
#pragma once

#include <string_view>

#include "core/weights/weight_map.h"

namespace color3d {

// Returns the bytes of weights.safetensors, valid until the program ends.
std::string_view EmbeddedWeightFile();

// Returns the arrays with names that start with `prefix` ("encoder.", "color_"), without the
// prefix, as float32. Empty prefix: all.
WeightMap EmbeddedWeights(std::string_view prefix);

}  // namespace color3d
