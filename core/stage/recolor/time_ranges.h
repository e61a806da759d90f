// Ranges of time of a film that key frames count in. For the stages of this layer only.
#pragma once

#include <vector>

#include "core/scene/scene.h"
#include "core/stage/options/key_color_options.h"

namespace color3d {

// The frames of one shot within one range of time, and the key frames that have this range.
struct RecoloredRange {
  std::vector<int> views;  // in order of time
  struct Key {
    int view = 0;
    const FurtherKeyView* given = nullptr;
  };
  std::vector<Key> keys;  // as they were given
};

// Of key frames that all have a range. Throws Error{kInvalidArgument}, naming the key frame: it has
// no range; that ends before it begins, reaches out of the film, or is without the key frame; two
// of one shot share some frames, but not all; a frame is a key frame twice, or held out; the scene
// is no film, or has poses.
std::vector<RecoloredRange> RangesOf(const std::vector<FurtherKeyView>& keys, const Scene& scene);

}  // namespace color3d
