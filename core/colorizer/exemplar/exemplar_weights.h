// Weights of the feed-forward colorizer that are part of the program. CARD.md beside this file
// describes their training and accuracy.
#pragma once

#include <string_view>

namespace color3d {

// Returns the bytes of weights.safetensors, valid until the program ends.
std::string_view ExemplarWeightFile();

}  // namespace color3d
