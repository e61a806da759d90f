#include "core/splat/training/training_state.h"

#include <numeric>
#include <utility>

namespace color3d {

int ViewOrder::Next(int view_count, Random& random) {
  if (next >= static_cast<int64_t>(views.size())) {
    views.resize(view_count);
    std::iota(views.begin(), views.end(), 0);
    for (int i = view_count - 1; i > 0; --i) {  // Fisher-Yates
      std::swap(views[i], views[random.NextBelow(static_cast<uint32_t>(i) + 1)]);
    }
    next = 0;
  }
  return views[next++];
}

}  // namespace color3d
