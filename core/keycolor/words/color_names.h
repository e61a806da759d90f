// Colours by name. The table holds typical colours of things in photographs, not primaries of
// screens, which are written as #rrggbb. Pure functions.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/color/lab.h"

namespace color3d {

struct NamedColor {
  std::string name;  // as written: "pale sky blue", "#4682b4"
  LabColor lab;
  size_t words = 0;  // number of words of the name
};

// Returns the colour with the longest name that starts at `words[begin]`: modifiers (light, pale,
// pastel, dull, dark, deep, bright, vivid, ...), then a name of one or two words, #rgb or #rrggbb.
// Words are lower-case. Modifiers change the chroma only, since L is that of the photo.
std::optional<NamedColor> ColorAt(const std::vector<std::string>& words, size_t begin);

// All names, sorted, for messages.
std::vector<std::string> KnownColorNames();

// Returns a, b of `color` at luminance `l`. Chroma is largest at the colour's own luminance and
// falls towards black and white, as in shadows and highlights.
struct Chroma {
  double a = 0.0;
  double b = 0.0;
};
Chroma ChromaAtLuminance(const LabColor& color, double l);

}  // namespace color3d
