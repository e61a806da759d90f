#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "core/carry/confidence.h"
#include "core/carry/view_propagation.h"
#include "core/stage/coloring/view_coloring.h"

namespace color3d {
namespace {

// Traced colours count as seen, spread ones as inferred.
FusedColor AsFused(const CarriedColor& color) {
  FusedColor fused{color.ab, Image(color.ab.width, color.ab.height, kProvenancePlanes)};
  for (size_t i = 0; i < color.confidence.data.size(); ++i) {
    fused.provenance.Plane(kSeenPlane)[i] = color.confidence.data[i];
    fused.provenance.Plane(kInferredPlane)[i] = 1.0f - color.confidence.data[i];
  }
  return fused;
}

void WarnOfUnconnected(const std::vector<int>& views, const Scene& scene, StageContext& context) {
  constexpr size_t kMaxNamed = 8;
  if (views.empty()) return;
  std::vector<std::string> names;
  for (const int view : views) {
    if (names.size() < kMaxNamed) names.push_back(scene.views[view].name);
  }
  context.Warn(
      "{} views share no point and no shot with a view that the key view's colours reach, and "
      "stay grey: {}{}; colour another key view among them",
      views.size(),
      fmt::join(names, ", "),
      views.size() > kMaxNamed ? ", ..." : "");
}

void LeaveGray(const std::vector<int>& views, const ViewColoring& coloring) {
  for (const int view : views) {
    if (coloring.done.WasDone(view)) continue;
    const Camera camera = coloring.images.WorkingCamera(view);
    FusedColor gray{Image(camera.width, camera.height, 2),
                    Image(camera.width, camera.height, kProvenancePlanes)};
    std::fill_n(gray.provenance.Plane(kGuessedPlane), gray.provenance.PlaneSize(), 1.0f);
    coloring.done.Add(view, gray);
  }
}

}  // namespace

void ColorByFlow(const ViewColoring& coloring, StageContext& context) {
  const std::vector<int> keys = KeyViewsOf(coloring.scene, context);
  const PropagationPlan plan = PlanPropagation(coloring.scene, keys, coloring.are_frames);
  WarnOfUnconnected(plan.unconnected, coloring.scene, context);
  // Colours of the views of the last level, and of the one before it. An interrupted run computes
  // them again.
  std::map<int, CarriedColor> last;
  for (const std::vector<int>& level : plan.levels) {
    std::vector<CarriedColor> colors(level.size());
    context.pool().ForEach(std::ssize(level), [&](int64_t i, int) {
      context.ThrowIfCancelled();
      const int view = level[i], source = plan.source[view];
      colors[i] = source < 0 ? GivenColor(coloring, view, context)
                             : PropagateByFlow(last.at(source),
                                               *coloring.images.Luminance(source),
                                               *coloring.images.Luminance(view),
                                               context.cancel());
      if (!coloring.done.WasDone(view)) coloring.done.Add(view, AsFused(colors[i]));
    });
    last.clear();
    for (size_t i = 0; i < level.size(); ++i) last[level[i]] = std::move(colors[i]);
  }
  LeaveGray(plan.unconnected, coloring);
}

}  // namespace color3d
