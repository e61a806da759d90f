// Options of the stage correct_colors.
#pragma once

#include <vector>

#include "core/stage/options/key_color_options.h"

namespace color3d {

struct CorrectColorsOptions {
  // Parts of photos in the colours that they should have, later ones over earlier ones, at most 64:
  // strokes, points or a picture (sources/given_colors.h). No held-out views. Of a film: key frames
  // with a range of time (recolor/time_ranges.h), from any source.
  std::vector<FurtherKeyView> corrections;
  int proposals = 3;  // how many further places are named, 0..16
  void Validate() const;
  bool operator==(const CorrectColorsOptions&) const = default;
};

}  // namespace color3d
