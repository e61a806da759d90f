// The pre-trained weights that are part of the program; see CARD.md beside this file for what they
// were trained on and how well they do.
#pragma once

#include <string_view>

#include "core/weights/weight_map.h"

namespace color3d {

// The bytes of weights.safetensors, for as long as the program runs.
std::string_view EmbeddedWeightFile();

// The arrays whose names start with `prefix` ("encoder.", "color_"), under the rest of their names,
// as float32; an empty prefix: all.
WeightMap EmbeddedWeights(std::string_view prefix);

}  // namespace color3d
