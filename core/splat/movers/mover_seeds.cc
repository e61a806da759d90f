#include "core/splat/movers/mover_seeds.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/motion/motion.h"
#include "core/splat/movers/foot_depths.h"
#include "core/splat/movers/mover_velocity.h"
#include "core/splat/raster/raster_constants.h"

namespace color3d {
namespace {

constexpr int kDepths = 64;        // tried along a ray, evenly in 1 / depth
constexpr double kNearest = 0.15;  // relative to the depth of the static surface
constexpr double kBehind = 1.03;   // relative to a surface's depth: occluded beyond it
constexpr int kPatchRadius = 2;    // of the compared luminance windows, px
constexpr double kSeedOpacity = 0.3;
constexpr double kFootprint =
    0.6;  // a seed's standard deviation, relative to the distance between seeds

struct Pixel {
  int x = 0;
  int y = 0;
};

float AtClamped(const Image& image, int x, int y) {
  return image.At(0, std::clamp(y, 0, image.height - 1), std::clamp(x, 0, image.width - 1));
}

// Correlation of two windows, -1..1; 0 if one of them is flat.
double Correlation(const Image& a, Pixel p, const Image& b, Pixel q) {
  double sa = 0.0, sb = 0.0, saa = 0.0, sbb = 0.0, sab = 0.0;
  int n = 0;
  for (int dy = -kPatchRadius; dy <= kPatchRadius; ++dy) {
    for (int dx = -kPatchRadius; dx <= kPatchRadius; ++dx) {
      const double u = AtClamped(a, p.x + dx, p.y + dy), v = AtClamped(b, q.x + dx, q.y + dy);
      sa += u;
      sb += v;
      saa += u * u;
      sbb += v * v;
      sab += u * v;
      ++n;
    }
  }
  const double va = saa - sa * sa / n, vb = sbb - sb * sb / n;
  if (!(va > 1e-5 * n) || !(vb > 1e-5 * n)) return 0.0;
  return (sab - sa * sb / n) / std::sqrt(va * vb);
}

bool MovesNear(const Image& moving, Pixel p) {
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (AtClamped(moving, p.x + dx, p.y + dy) > 0.0f) return true;
    }
  }
  return false;
}

// Views of one time.
using Views = std::vector<const SurveyedView*>;

// Agreement of the other cameras on motion at this point; none if a camera sees the point without
// motion, or if no camera sees it.
std::optional<double> Agreement(const Views& moment,
                                const SurveyedView& own,
                                Pixel pixel,
                                const Eigen::Vector3d& point) {
  double sum = 0.0;
  int seen = 0;
  for (const SurveyedView* other : moment) {
    if (other == &own) continue;
    const Eigen::Vector3d p = other->posed.cam_from_world.Apply(point);
    if (!(p.z() > kNearPlane)) continue;
    const Eigen::Vector2d at = other->posed.camera.Project(p);
    if (!other->posed.camera.Contains(at)) continue;
    const Pixel q{static_cast<int>(at.x()), static_cast<int>(at.y())};
    if (!MovesNear(other->moving, q)) {
      const float surface = other->depth.At(0, q.y, q.x);
      if (surface > 0.0f && p.z() > kBehind * surface) continue;  // hidden
      return std::nullopt;
    }
    sum += 1.0 + Correlation(own.luminance, pixel, other->luminance, q);
    ++seen;
  }
  if (seen == 0) return std::nullopt;
  return sum / seen;
}

std::vector<MoverSeed> SeedsOf(const SurveyedView& view,
                               const Image& foot,
                               const Views& moment,
                               int step) {
  std::vector<MoverSeed> seeds;
  const double usual = MedianDepth(view);
  if (!(usual > 0.0)) return seeds;
  const Camera& camera = view.posed.camera;
  for (int y = 0; y < camera.height; y += step) {
    // Every other row is offset by half a step.
    for (int x = y / step % 2 * (step / 2); x < camera.width; x += step) {
      if (view.moving.At(0, y, x) == 0.0f) continue;
      const float surface = view.depth.At(0, y, x);
      const double farthest = surface > 0.0f ? surface : 2.0 * usual;
      const double nearest = std::max(kNearest * std::min(farthest, usual), 2.0 * kNearPlane);
      if (!(nearest < farthest)) continue;
      const Eigen::Vector3d ray = camera.Ray(x + 0.5, y + 0.5);
      double best = -1.0, depth = std::min<double>(foot.At(0, y, x), farthest);
      for (int k = 0; k < kDepths; ++k) {
        const double share = static_cast<double>(k) / (kDepths - 1);
        const double d = 1.0 / ((1.0 - share) / farthest + share / nearest);
        const std::optional<double> agreement =
            Agreement(moment, view, {x, y}, view.posed.cam_from_world.WorldFromCamera(d * ray));
        if (agreement && *agreement > best) {
          best = *agreement;
          depth = d;
        }
      }
      MoverSeed seed{x, y, depth};
      seed.position = view.posed.cam_from_world.WorldFromCamera(depth * ray);
      seeds.push_back(seed);
    }
  }
  return seeds;
}

// Appends the seeds of one view.
void Append(const SurveyedView& view,
            const std::vector<MoverSeed>& seeds,
            float time,
            int step,
            const MoverSeedOptions& options,
            ParameterBlock& block) {
  const auto logit = static_cast<float>(std::log(kSeedOpacity / (1.0 - kSeedOpacity)));
  const auto width = static_cast<float>(std::log(options.width * options.interval));
  int64_t i = block.count();
  block.Resize(i + static_cast<int64_t>(seeds.size()));
  for (const MoverSeed& seed : seeds) {
    const double scale = kFootprint * step * seed.depth / view.posed.camera.fx;
    for (int k = 0; k < 3; ++k) {
      block.Row(kPositionRow + k)[i] = static_cast<float>(seed.position[k]);
      block.Row(kLogScaleRow + k)[i] = static_cast<float>(std::log(scale));
      block.Row(options.rows + kVelocityRow + k)[i] = static_cast<float>(seed.velocity[k]);
    }
    block.Row(kRotationRow)[i] = 1.0f;
    block.Row(kOpacityRow)[i] = logit;
    const float luminance = view.luminance.At(0, seed.y, seed.x);
    for (int c = 0; c < options.channels; ++c) {
      block.Row(kColorRow + c * options.coefficients)[i] = (luminance - 0.5f) / kShDc;
    }
    block.Row(options.rows + kCenterRow)[i] = time;
    block.Row(options.rows + kLogWidthRow)[i] = width;
    ++i;
  }
}

}  // namespace

ParameterBlock SeedMovers(const std::vector<SurveyedView>& views,
                          const std::vector<float>& unit_time,
                          const MoverSeedOptions& options,
                          ThreadPool& pool) {
  std::map<double, Views> moments;
  double moving = 0.0;
  for (const SurveyedView& view : views) {
    moments[view.posed.time_s].push_back(&view);
    for (const float m : view.moving.data) moving += m;
  }
  const int step = std::max(
      1,
      static_cast<int>(
          std::ceil(std::sqrt(moving / static_cast<double>(std::max<int64_t>(1, options.most))))));
  std::vector<std::vector<MoverSeed>> seeds(views.size());
  const std::vector<Image> feet = FootDepths(views, pool);
  pool.ForEach(static_cast<int64_t>(views.size()), [&](int64_t i, int) {
    seeds[i] = SeedsOf(views[i], feet[i], moments.at(views[i].posed.time_s), step);
  });
  FindVelocities(views, unit_time, step, pool, seeds);
  ParameterBlock block(options.rows + kMotionRows, 0);
  for (size_t i = 0; i < views.size(); ++i) {
    Append(views[i], seeds[i], unit_time[i], step, options, block);
  }
  return block;
}

}  // namespace color3d
