// Colours by name. The table holds what things of that colour look like in photographs, not the
// screen's primaries: whoever wants those writes #rrggbb. Pure functions.
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
  size_t words = 0;  // how many words the name takes
};

// The colour whose name starts at `words[begin]`, the longest that fits: modifiers (light, pale,
// pastel, dull, dark, deep, bright, vivid, ...) and then a name of one or two words or #rgb or
// #rrggbb. Words are lower-case. Modifiers change the chroma; L is the photo's in the end.
std::optional<NamedColor> ColorAt(const std::vector<std::string>& words, size_t begin);

// All names, sorted: for messages.
std::vector<std::string> KnownColorNames();

// a, b of `color` on a pixel of luminance `l`: the chroma is largest at the colour's own luminance
// and falls towards black and white, as a coloured thing does in shadow and in a highlight.
struct Chroma {
  double a = 0.0;
  double b = 0.0;
};
Chroma ChromaAtLuminance(const LabColor& color, double l);

}  // namespace color3d
