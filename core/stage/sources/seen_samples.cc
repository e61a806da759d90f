#include "core/stage/sources/seen_samples.h"

#include <algorithm>
#include <cmath>

#include "core/base/evenly.h"
#include "core/film/local_contrast.h"
#include "core/image/flow_agreement.h"
#include "core/image/plane_sampling.h"
#include "core/stage/film/frames_of_views.h"
#include "core/stage/film/steady_frames.h"
#include "core/stage/sources/render_view.h"

namespace color3d {
namespace {

constexpr int kColumns = 16, kRows = 12;
constexpr int kDepthSidePx = 128;
constexpr float kMinOpacity = 0.5f;
constexpr double kDepthTolerance = 0.06;  // relative; coarse, as the depth maps are

struct Surface {
  Camera camera;
  Pose pose;
  Image depth;  // 0: no surface
};

bool Shows(const Surface& view, const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = view.pose.Apply(point);
  if (!(p.z() > 1e-6)) return false;
  const Eigen::Vector2d pixel = view.camera.Project(p);
  if (!view.camera.Contains(pixel)) return false;
  // One agreeing neighbour is enough: edges are a blend of two depths.
  for (int dy = -1; dy <= 0; ++dy) {
    for (int dx = -1; dx <= 0; ++dx) {
      const int x = std::clamp(static_cast<int>(pixel.x() + 0.5) + dx, 0, view.camera.width - 1);
      const int y = std::clamp(static_cast<int>(pixel.y() + 0.5) + dy, 0, view.camera.height - 1);
      const double depth = view.depth.At(0, y, x);
      if (depth > 0.0 && std::abs(depth - p.z()) < kDepthTolerance * p.z()) return true;
    }
  }
  return false;
}

constexpr size_t kMaxFlowFrames = 240;  // of all shots together
constexpr int kPatchRadius = 3;
constexpr double kMaxUnlikeness = 1.7 * kUnlikeness;  // half of the confidence of carried colour

// Frames of a film, in the order of time, with the optical flow from each to the next one of its shot.
struct FlowChain {
  std::vector<int> views;
  std::vector<Image> contrast;
  std::vector<std::shared_ptr<const FlowPair>> to_next;  // null: the shot ends
};

FlowChain ChainOf(const Scene& scene,
                  const std::vector<int>& candidates,
                  const ViewImages& images,
                  ThreadPool& pool,
                  const CancellationToken& cancel) {
  FlowChain chain;
  std::vector<int> shots;
  const size_t between =
      kMaxFlowFrames > candidates.size() ? kMaxFlowFrames - candidates.size() : 0;
  for (const auto& [shot, frames] : FramesByShot(scene)) {
    const size_t share = std::max<size_t>(1, between * frames.size() / scene.views.size());
    const std::vector<int> even = PickEvenly(frames, share);
    for (const int frame : frames) {
      if (!std::ranges::count(even, frame) && !std::ranges::count(candidates, frame)) continue;
      chain.views.push_back(frame);
      shots.push_back(shot);
    }
  }
  const auto count = std::ssize(chain.views);
  chain.to_next.resize(chain.views.size());
  chain.contrast.resize(chain.views.size());
  pool.ForEach(count, [&](int64_t i, int) {
    cancel.ThrowIfCancelled();
    const auto luminance = images.Luminance(chain.views[i]);
    chain.contrast[i] = LocalContrast(*luminance);
    if (i + 1 == count || shots[i] != shots[i + 1]) return;
    chain.to_next[i] = FlowBetween(*luminance, *images.Luminance(chain.views[i + 1]));
  });
  return chain;
}

// Moves a place along a flow, px. False where it is lost.
bool Follow(const Image& there, const Image& back, double* x, double* y) {
  const double dx = SampleBilinear(there, 0, *x, *y), dy = SampleBilinear(there, 1, *x, *y);
  *x += dx;
  *y += dy;
  if (*x < -0.5 || *y < -0.5 || *x > there.width - 0.5 || *y > there.height - 0.5) return false;
  return FlowAgrees(dx, dy, SampleBilinear(back, 0, *x, *y), SampleBilinear(back, 1, *x, *y));
}

// Mean difference of local contrast around a place of each picture, 0..2.
double PatchDifference(const Image& one, double x, double y, const Image& other, double ox, double oy) {
  double sum = 0.0;
  for (int dy = -kPatchRadius; dy <= kPatchRadius; ++dy) {
    for (int dx = -kPatchRadius; dx <= kPatchRadius; ++dx) {
      const float a = SampleBilinear(one, 0, x + dx, y + dy);
      const float b = SampleBilinear(other, 0, ox + dx, oy + dy);
      sum += std::min(2.0f, std::abs(a - b));
    }
  }
  return sum / ((2 * kPatchRadius + 1) * (2 * kPatchRadius + 1));
}

}  // namespace

SampleGrid GridFor(int views) {
  const int samples = SeenSamples::SamplesFor(views, kColumns * kRows);
  const int rows = std::max(1, static_cast<int>(std::sqrt(0.75 * samples)));
  return {samples / rows, rows};
}

SeenSamples SeenByGeometry(const Scene& scene,
                           const std::vector<int>& views,
                           const GaussianModel& geometry,
                           const SampleGrid& grid,
                           ThreadPool& pool,
                           const CancellationToken& cancel) {
  const int count = static_cast<int>(views.size());
  std::vector<Surface> surfaces;
  for (const int view : views) {
    cancel.ThrowIfCancelled();
    const Camera camera = scene.views[view].camera.FitWithin(kDepthSidePx);
    const Pose& pose = scene.views[view].cam_from_world;
    RenderedView rendered = RenderView(geometry, scene.views[view], camera, pool);
    for (size_t i = 0; i < rendered.depth.data.size(); ++i) {
      if (rendered.opacity.data[i] < kMinOpacity) rendered.depth.data[i] = 0.0f;
    }
    surfaces.push_back({camera, pose, std::move(rendered.depth)});
  }
  SeenSamples seen(count, grid.samples());
  for (int view = 0; view < count; ++view) {
    const Surface& from = surfaces[view];
    for (int s = 0; s < grid.samples(); ++s) {
      const double x = grid.X(s) * from.camera.width, y = grid.Y(s) * from.camera.height;
      const double depth = from.depth.At(0,
                                         std::min(static_cast<int>(y), from.camera.height - 1),
                                         std::min(static_cast<int>(x), from.camera.width - 1));
      if (!(depth > 0.0)) continue;
      const Eigen::Vector3d point = from.pose.WorldFromCamera(depth * from.camera.Ray(x, y));
      for (int by = 0; by < count; ++by) {
        if (by == view || Shows(surfaces[by], point)) seen.SetSeen(by, view, s);
      }
    }
  }
  return seen;
}

SeenSamples SeenByFlow(const Scene& scene,
                       const std::vector<int>& views,
                       const ViewImages& images,
                       const SampleGrid& grid,
                       ThreadPool& pool,
                       const CancellationToken& cancel) {
  const FlowChain chain = ChainOf(scene, views, images, pool, cancel);
  const int frames = static_cast<int>(chain.views.size());
  std::vector<int> candidate_of(scene.views.size(), -1);
  for (size_t k = 0; k < views.size(); ++k) candidate_of[views[k]] = static_cast<int>(k);
  SeenSamples seen(static_cast<int>(views.size()), grid.samples());
  pool.ForEach(frames, [&](int64_t from, int) {
    const int view = candidate_of[chain.views[from]];
    if (view < 0) return;
    cancel.ThrowIfCancelled();
    const Image& own = chain.contrast[from];
    for (int s = 0; s < grid.samples(); ++s) {
      seen.SetSeen(view, view, s);
      for (const int direction : {1, -1}) {
        const double x0 = grid.X(s) * own.width - 0.5, y0 = grid.Y(s) * own.height - 0.5;
        double x = x0, y = y0;
        for (int at = static_cast<int>(from);;) {
          const int pair = direction > 0 ? at : at - 1;
          if (pair < 0 || pair >= frames || !chain.to_next[pair]) break;
          const FlowPair& flow = *chain.to_next[pair];
          const bool forth = direction > 0;
          if (!Follow(forth ? flow.forth : flow.back, forth ? flow.back : flow.forth, &x, &y)) break;
          at += direction;
          if (PatchDifference(own, x0, y0, chain.contrast[at], x, y) > kMaxUnlikeness) continue;
          if (candidate_of[chain.views[at]] >= 0) seen.SetSeen(candidate_of[chain.views[at]], view, s);
        }
      }
    }
  });
  return seen;
}

std::filesystem::path FeatureCache(const StageContext& context) {
  const std::filesystem::path& folder = context.cache_folder();
  return folder.empty() ? folder : folder / "view_features";
}

SeenSamples SeenByPoints(const Scene& scene, const std::vector<int>& views) {
  std::vector<int> index_of(scene.views.size(), -1);
  for (size_t k = 0; k < views.size(); ++k) index_of[views[k]] = static_cast<int>(k);
  std::vector<std::vector<const SparsePoint*>> points(views.size());
  size_t most = 0;
  for (const SparsePoint& point : scene.points) {
    for (const int view : point.views) {
      if (index_of[view] < 0) continue;
      points[index_of[view]].push_back(&point);
      most = std::max(most, points[index_of[view]].size());
    }
  }
  const int count = static_cast<int>(views.size());
  if (most == 0) return SeenSamples(count, 0);
  SeenSamples seen(count, SeenSamples::SamplesFor(count, kColumns * kRows));
  for (int view = 0; view < count; ++view) {
    const auto& own = points[view];
    for (int s = 0; s < seen.samples() && !own.empty(); ++s) {
      const SparsePoint& point = *own[static_cast<size_t>(s) * own.size() / seen.samples()];
      for (const int by : point.views) {
        if (index_of[by] >= 0) seen.SetSeen(index_of[by], view, s);
      }
    }
  }
  return seen;
}

}  // namespace color3d
