// Where in a scene's photos the user's colour would tell most. Pure functions, thread-safe.
#pragma once

#include <vector>

#include "core/base/image.h"

namespace color3d {

struct UncertainPlace {
  int view = -1;  // index into what was given; -1: everything is sure
  // Pixel of that view's confidence map, and how large a surface there is unsure.
  int x = 0, y = 0;
  double uncertainty = 0.0;  // 0..1: mean of 1 - confidence around it
};

// The middle of the least certain surroundings, a tenth of the longer side around, of all views.
// `confidence`: 1 channel, 0..1, of each view; empty for views that must not be chosen.
UncertainPlace LeastCertainPlace(const std::vector<Image>& confidence);

}  // namespace color3d
