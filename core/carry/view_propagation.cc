#include "core/carry/view_propagation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "core/carry/fusion.h"
#include "core/image/codec.h"
#include "core/image/flow_agreement.h"
#include "core/image/optical_flow.h"
#include "core/image/plane_sampling.h"

namespace color3d {
namespace {

// Cost of a step to a neighbouring frame, as that of an overlap of 98 %.
constexpr double kFrameStepCost = 0.02;
// Weight of grey where no colour was found, as FusionOptions::inferred_weight: colours fade within
// about 30 px.
constexpr double kFading = 1e-3;

struct Step {
  int to = 0;
  double cost = 0.0;
};
using Steps = std::vector<std::vector<Step>>;  // by view

// Number of points that each view observes, and that each pair of views does.
struct SharedPoints {
  std::vector<int> of_view;
  std::map<std::pair<int, int>, int> of_pair;  // the smaller index first
};

SharedPoints CountSharedPoints(const Scene& scene) {
  SharedPoints shared{std::vector<int>(scene.views.size()), {}};
  for (const SparsePoint& point : scene.points) {
    const std::set<int> views(point.views.begin(), point.views.end());
    for (auto first = views.begin(); first != views.end(); ++first) {
      ++shared.of_view[*first];
      for (auto second = std::next(first); second != views.end(); ++second) {
        ++shared.of_pair[{*first, *second}];
      }
    }
  }
  return shared;
}

void AddOverlaps(const Scene& scene, bool of_one_time, Steps* steps) {
  const SharedPoints shared = CountSharedPoints(scene);
  for (const auto& [pair, count] : shared.of_pair) {
    const auto [a, b] = pair;
    if (of_one_time && scene.views[a].time_s() != scene.views[b].time_s()) continue;
    const double cost =
        -std::log(count / std::sqrt(static_cast<double>(shared.of_view[a]) * shared.of_view[b]));
    if (!scene.views[a].held_out) (*steps)[a].push_back({b, cost});
    if (!scene.views[b].held_out) (*steps)[b].push_back({a, cost});
  }
}

void AddFrameSteps(const Scene& scene, Steps* steps) {
  std::map<int, int> last_of_shot;
  for (const int view : scene.ViewsInOrderOfTime()) {
    const auto [last, is_first] = last_of_shot.try_emplace(scene.views[view].moment->shot, view);
    if (is_first) continue;
    (*steps)[last->second].push_back({view, kFrameStepCost});
    (*steps)[view].push_back({last->second, kFrameStepCost});
    last->second = view;
  }
}

Image ResizedTo(const Image& image, const Image& size) {
  if (image.width == size.width && image.height == size.height) return image;
  return Resize(image, size.width, size.height);
}

}  // namespace

PropagationPlan PlanPropagation(const Scene& scene,
                                const std::vector<int>& key_views,
                                bool along_shots) {
  Steps steps(scene.views.size());
  if (along_shots) AddFrameSteps(scene, &steps);
  AddOverlaps(scene, /*of_one_time=*/along_shots, &steps);
  // Dijkstra's algorithm; of equal costs the lower index first.
  std::vector<double> cost(scene.views.size(), std::numeric_limits<double>::infinity());
  std::vector<int> depth(scene.views.size(), 0);
  PropagationPlan plan;
  plan.source.assign(scene.views.size(), -1);
  std::set<std::pair<double, int>> open;
  for (const int key : key_views) {
    cost[key] = 0.0;
    open.insert({0.0, key});
  }
  while (!open.empty()) {
    const int view = open.begin()->second;
    open.erase(open.begin());
    const auto level = static_cast<size_t>(depth[view]);
    if (plan.levels.size() <= level) plan.levels.resize(level + 1);
    plan.levels[level].push_back(view);
    for (const Step& step : steps[view]) {
      if (cost[view] + step.cost >= cost[step.to]) continue;
      open.erase({cost[step.to], step.to});
      cost[step.to] = cost[view] + step.cost;
      depth[step.to] = depth[view] + 1;
      plan.source[step.to] = view;
      open.insert({cost[step.to], step.to});
    }
  }
  for (std::vector<int>& level : plan.levels) std::ranges::sort(level);
  for (size_t i = 0; i < cost.size(); ++i) {
    if (std::isinf(cost[i])) plan.unconnected.push_back(static_cast<int>(i));
  }
  return plan;
}

CarriedColor PropagateByFlow(const CarriedColor& color,
                             const Image& luminance,
                             const Image& target,
                             const CancellationToken& cancel) {
  const Image source = ResizedTo(luminance, target);
  const Image ab = ResizedTo(color.ab, target);
  const Image confidence = ResizedTo(color.confidence, target);
  const Image there = DenseFlow(target, source);
  const Image back = DenseFlow(source, target);
  const int width = target.width, height = target.height;
  CarriedColor out{Image(width, height, 2), Image(width, height, 1)};
  Image matched(width, height, 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double fx = there.At(0, y, x), fy = there.At(1, y, x);
      const double sx = x + fx, sy = y + fy;
      if (sx < 0.0 || sy < 0.0 || sx > width - 1.0 || sy > height - 1.0) continue;
      if (!FlowAgrees(fx, fy, SampleBilinear(back, 0, sx, sy), SampleBilinear(back, 1, sx, sy))) {
        continue;
      }
      matched.At(0, y, x) = 1.0f;
      for (int k = 0; k < 2; ++k) out.ab.At(k, y, x) = SampleBilinear(ab, k, sx, sy);
      out.confidence.At(0, y, x) = SampleBilinear(confidence, 0, sx, sy);
    }
  }
  // Known colours spread between the edges of the luminance, and fade.
  FusionOptions spread;
  spread.inferred_weight = kFading;
  ThreadPool one(1);
  out.ab = FuseColors({target, {std::move(out.ab), matched}, Image(width, height, 2), {}, {}},
                      spread,
                      one,
                      cancel)
               .ab;
  return out;
}

}  // namespace color3d
