// Ranges of time of a film that key views recolour. Stateless.
#pragma once

#include <vector>

#include "core/scene/scene.h"
#include "core/stage/options/correct_colors_options.h"

namespace color3d {

// The frames of one shot within one range of time, and the key views that have this range.
struct RecoloredRange {
  std::vector<int> views;  // in order of time
  struct Key {
    int view = 0;
    const RangeKeyView* given = nullptr;
  };
  std::vector<Key> keys;  // as they were given
};

// Throws Error{kInvalidArgument} naming the key view: its range ends before it begins, reaches out
// of the film, or does not contain the key view; two ranges of one shot share some frames, but not
// all; a view is given twice for one range, or held out; the scene is no film, or has poses.
std::vector<RecoloredRange> RangesOf(const std::vector<RangeKeyView>& keys, const Scene& scene);

}  // namespace color3d
