#include "core/splat/movers/mover_velocity.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/image/optical_flow.h"

namespace color3d {
namespace {

constexpr double kFarthest = 0.2;  // maximum movement per time step, relative to the depth

// The views of each camera, ordered by time.
std::vector<std::vector<size_t>> ByCamera(const std::vector<SurveyedView>& views) {
  std::map<int, std::vector<size_t>> cameras;
  for (size_t i = 0; i < views.size(); ++i) cameras[views[i].posed.shot].push_back(i);
  std::vector<std::vector<size_t>> sorted;
  for (auto& [shot, frames] : cameras) {
    std::stable_sort(frames.begin(), frames.end(), [&](size_t a, size_t b) {
      return views[a].posed.time_s < views[b].posed.time_s;
    });
    sorted.push_back(std::move(frames));
  }
  return sorted;
}

// Depth of the nearest seed within `radius` px; 0 without one.
double DepthNear(const std::vector<MoverSeed>& seeds, double x, double y, double radius) {
  double best = radius * radius, depth = 0.0;
  for (const MoverSeed& seed : seeds) {
    const double dx = seed.x + 0.5 - x, dy = seed.y + 0.5 - y;
    if (dx * dx + dy * dy <= best) {
      best = dx * dx + dy * dy;
      depth = seed.depth;
    }
  }
  return depth;
}

Image InLab(const Image& luminance) {
  Image l = luminance;
  for (float& v : l.data) v *= 100.0f;
  return l;
}

// Position in `to` of a seed of `from`; none if nothing moves there.
std::optional<Eigen::Vector3d> PositionIn(const MoverSeed& seed,
                                          const Image& flow,
                                          const SurveyedView& to,
                                          const std::vector<MoverSeed>& seeds,
                                          int step) {
  const double x = seed.x + 0.5 + flow.At(0, seed.y, seed.x);
  const double y = seed.y + 0.5 + flow.At(1, seed.y, seed.x);
  if (!to.posed.camera.Contains({x, y})) return std::nullopt;
  if (to.moving.At(0, static_cast<int>(y), static_cast<int>(x)) == 0.0f) return std::nullopt;
  const double found = DepthNear(seeds, x, y, 1.5 * step);
  const double depth = found > 0.0 ? found : seed.depth;
  const Eigen::Vector3d position =
      to.posed.cam_from_world.WorldFromCamera(depth * to.posed.camera.Ray(x, y));
  if ((position - seed.position).norm() > kFarthest * seed.depth) return std::nullopt;
  return position;
}

}  // namespace

void FindVelocities(const std::vector<SurveyedView>& views,
                    const std::vector<float>& unit_time,
                    int step,
                    ThreadPool& pool,
                    std::vector<std::vector<MoverSeed>>& seeds) {
  const std::vector<std::vector<size_t>> cameras = ByCamera(views);
  std::vector<std::vector<size_t>> neighbors(views.size());
  for (const std::vector<size_t>& frames : cameras) {
    for (size_t k = 0; k + 1 < frames.size(); ++k) {
      const Image &a = views[frames[k]].luminance, &b = views[frames[k + 1]].luminance;
      if (a.width != b.width || a.height != b.height) continue;
      neighbors[frames[k]].push_back(frames[k + 1]);
      neighbors[frames[k + 1]].push_back(frames[k]);
    }
  }
  pool.ForEach(static_cast<int64_t>(views.size()), [&](int64_t index, int) {
    const SurveyedView& view = views[index];
    if (seeds[index].empty()) return;
    std::vector<int> found(seeds[index].size(), 0);
    for (const size_t other : neighbors[index]) {
      const float time = unit_time[other] - unit_time[index];
      if (time == 0.0f) continue;
      const Image flow = DenseFlow(InLab(view.luminance), InLab(views[other].luminance));
      for (size_t s = 0; s < seeds[index].size(); ++s) {
        MoverSeed& seed = seeds[index][s];
        const std::optional<Eigen::Vector3d> position =
            PositionIn(seed, flow, views[other], seeds[other], step);
        if (!position) continue;
        seed.velocity += (*position - seed.position) / static_cast<double>(time);
        ++found[s];
      }
    }
    for (size_t s = 0; s < seeds[index].size(); ++s) {
      if (found[s] > 0) seeds[index][s].velocity /= found[s];
    }
  });
}

}  // namespace color3d
