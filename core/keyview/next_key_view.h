// Which view to colour next. Pure, thread-safe.
#pragma once

#include <optional>
#include <vector>

#include "core/scene/scene.h"

namespace color3d {

struct NextKeyViewAdvice {
  int view = 0;
  double covered_now = 0.0;   // share of what the views see that the key views show, 0..1
  double covered_with = 0.0;  // ... with this view coloured, too
};

// By the points of structure-from-motion, each counted as often as training views see it. Nothing
// when the scene has no tracked points or no view adds any.
std::optional<NextKeyViewAdvice> NextKeyView(const Scene& scene, const std::vector<int>& key_views);

}  // namespace color3d
