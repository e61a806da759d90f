#include "core/keyview/next_key_view.h"

#include <algorithm>

namespace color3d {

std::optional<NextKeyViewAdvice> NextKeyView(const Scene& scene,
                                             const std::vector<int>& key_views) {
  std::vector<double> gain(scene.views.size(), 0.0);
  double seen = 0.0;
  double covered = 0.0;
  for (const SparsePoint& point : scene.points) {
    const auto weight = static_cast<double>(point.views.size());
    seen += weight;
    const bool shown = std::any_of(point.views.begin(), point.views.end(), [&](int view) {
      return std::find(key_views.begin(), key_views.end(), view) != key_views.end();
    });
    if (shown) {
      covered += weight;
    } else {
      for (int view : point.views) gain.at(view) += weight;
    }
  }
  int best = -1;
  for (int view : scene.TrainingViews()) {
    if (gain[view] > 0.0 && (best < 0 || gain[view] > gain[best])) best = view;
  }
  if (best < 0) return std::nullopt;
  return NextKeyViewAdvice{best, covered / seen, (covered + gain[best]) / seen};
}

}  // namespace color3d
