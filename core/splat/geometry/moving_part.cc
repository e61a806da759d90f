#include "core/splat/geometry/moving_part.h"

#include <algorithm>
#include <set>

#include "core/scene/photo_masks.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/motion/motion.h"
#include "core/splat/movers/motion_survey.h"
#include "core/splat/raster/pipeline.h"
#include "core/splat/raster/raster_camera.h"

namespace color3d {
namespace {

constexpr double kMoverShare = 0.4;  // maximum share of the Gaussian cap
constexpr float kBackground[3] = {0.0f, 0.0f, 0.0f};

// Mean over the channels.
Image MeanImage(const PlaneBuffer& planes, int channels) {
  Image image(planes.width, planes.height, 1);
  for (int y = 0; y < planes.height; ++y) {
    for (int x = 0; x < planes.width; ++x) {
      float sum = 0.0f;
      for (int c = 0; c < channels; ++c) sum += planes.Row(c, y)[x];
      image.At(0, y, x) = sum / static_cast<float>(channels);
    }
  }
  return image;
}

// Replaces masked pixels by the render, so that nothing moves there. `mask` may be larger.
void CopyMasked(const Image& mask, const Image& luminance, Image& drawn) {
  for (int y = 0; y < drawn.height; ++y) {
    for (int x = 0; x < drawn.width; ++x) {
      const int from_y = static_cast<int>(int64_t{y} * mask.height / drawn.height);
      const int from_x = static_cast<int>(int64_t{x} * mask.width / drawn.width);
      if (mask.At(0, from_y, from_x) == 0.0f) drawn.At(0, y, x) = luminance.At(0, y, x);
    }
  }
}

// These training views as photographed and as rendered by `still`.
std::vector<SurveyedView> SurveyedViews(const GeometryProblem& problem,
                                        const std::vector<PosedCamera>& training,
                                        const ParameterBlock& still,
                                        const ColorSpec& color,
                                        const LevelTarget& target,
                                        ThreadPool& pool) {
  std::vector<SurveyedView> views;
  SplatPipeline pipeline;
  for (const PosedCamera& posed : training) {
    int level = 0;
    while (std::max(posed.camera.width, posed.camera.height) >> level > kSurveySidePx) ++level;
    const std::shared_ptr<const PlaneBuffer> picture = target(posed, level);
    SurveyedView view;
    view.posed = posed;
    view.posed.camera = posed.camera.Scaled(picture->width, picture->height);
    pipeline.Forward({still, color, MakeRasterCamera(view.posed.camera, posed.cam_from_world)},
                     kBackground,
                     true,
                     pool);
    view.luminance = MeanImage(*picture, color.channels);
    view.drawn = MeanImage(pipeline.color(), color.channels);
    view.depth = MeanImage(pipeline.median_depth(), 1);
    const std::shared_ptr<const Image> mask = problem.mask ? problem.mask(posed.view) : nullptr;
    if (mask != nullptr) CopyMasked(*mask, view.luminance, view.drawn);
    const std::shared_ptr<const Image> seen = problem.still ? problem.still(posed.view) : nullptr;
    if (seen != nullptr) {
      view.still = ResizeMask(*seen, view.luminance.width, view.luminance.height);
    }
    views.push_back(std::move(view));
  }
  return views;
}

void Append(const ParameterBlock& more, ParameterBlock* all) {
  if (all->count() == 0) {
    *all = more;
    return;
  }
  const int64_t first = all->count();
  all->Resize(first + more.count());
  for (int row = 0; row < all->rows(); ++row) {
    std::copy_n(more.Row(row), more.count(), all->Row(row) + first);
  }
}

DensifyStatistics Part(const DensifyStatistics& all, int64_t begin, int64_t end) {
  const auto cut = [&](const AlignedFloats& values) {
    return AlignedFloats(values.begin() + begin, values.begin() + end);
  };
  return {cut(all.gradient), cut(all.count), cut(all.radius)};
}

}  // namespace

float TimeSpan::UnitTime(double time_s) const {
  GaussianMotion motion;
  motion.begin_s = begin_s;
  motion.end_s = end_s;
  return motion.UnitTime(time_s);
}

TimeSpan TimeSpanOf(const GeometryProblem& problem) {
  std::set<double> times;
  for (const PosedCamera& view : problem.training) times.insert(view.time_s);
  for (const PosedCamera& view : problem.held_out) times.insert(view.time_s);
  if (times.empty()) return {};
  return {*times.begin(), *times.rbegin(), static_cast<int>(times.size())};
}

std::vector<std::vector<PosedCamera>> BlocksOfTime(const std::vector<PosedCamera>& views) {
  std::set<double> all;
  for (const PosedCamera& view : views) all.insert(view.time_s);
  const std::vector<double> times(all.begin(), all.end());
  const size_t wanted = std::max<size_t>(1, (views.size() + kViewsAtOnce - 1) / kViewsAtOnce);
  const size_t count = std::clamp<size_t>(times.size() / kFewestTimesAtOnce, 1, wanted);
  std::vector<std::vector<PosedCamera>> blocks(count);
  for (const PosedCamera& view : views) {
    const auto time = std::lower_bound(times.begin(), times.end(), view.time_s) - times.begin();
    blocks[static_cast<size_t>(time) * count / times.size()].push_back(view);
  }
  return blocks;
}

MoverSearchResult FindMovingPart(const GeometryProblem& problem,
                                 const TimeSpan& times,
                                 const ParameterBlock& still,
                                 const ColorSpec& color,
                                 const LevelTarget& target,
                                 const GeometryOptions& options,
                                 ThreadPool& pool) {
  MoverSeedOptions seeds;
  seeds.rows = still.rows();
  seeds.channels = color.channels;
  seeds.coefficients = ShCoefficients(options.sh_degree);
  seeds.width = TuningOf(options).seed_width;
  seeds.interval = times.Interval();
  MoverSearchResult found;
  double residual_share = 0.0, least_share = 0.0;
  ParameterBlock& parameters = found.moving.parameters;
  for (const std::vector<PosedCamera>& block : BlocksOfTime(problem.training)) {
    std::vector<SurveyedView> views = SurveyedViews(problem, block, still, color, target, pool);
    const double share =
        static_cast<double>(block.size()) / static_cast<double>(problem.training.size());
    const MotionSurvey survey = SurveyMotion(pool, views);
    found.moving_share += share * survey.moving_share;
    residual_share += share * survey.residual_share;
    least_share += share * survey.least_share;
    seeds.most = static_cast<int64_t>(share * kMoverShare * options.max_gaussians);
    std::vector<float> unit_time;
    for (const PosedCamera& view : block) unit_time.push_back(times.UnitTime(view.time_s));
    Append(SeedMovers(views, unit_time, seeds, pool), &parameters);
  }
  if (residual_share < least_share) {
    parameters = {};
    return found;
  }
  const ParameterBlock zeros = parameters.ZerosOfSameShape();
  found.moving.moments = {zeros, zeros};
  return found;
}

void ComposeAt(const ParameterBlock& still,
               const MovingPart& moving,
               float t,
               ThreadPool& pool,
               ParameterBlock& at,
               float hidden) {
  const int64_t first = still.count(), count = first + moving.parameters.count();
  if (at.rows() != still.rows()) at = ParameterBlock(still.rows(), count);
  if (at.count() != count) at.Resize(count);
  pool.ForRanges(still.rows(), [&](int64_t begin, int64_t end, int) {
    for (int row = static_cast<int>(begin); row < end; ++row) {
      std::copy_n(still.Row(row), first, at.Row(row));
      std::copy_n(moving.parameters.Row(row), moving.parameters.count(), at.Row(row) + first);
    }
  });
  ApplyMotion({moving.parameters, still.rows(), t, first}, pool, at, hidden);
}

void DecomposeGradient(const ParameterBlock& still,
                       const MovingPart& moving,
                       float t,
                       const ParameterBlock& at,
                       ThreadPool& pool,
                       ParameterBlock& gradient,
                       ParameterBlock& moving_gradient) {
  ApplyMotionBackward(
      {moving.parameters, still.rows(), t, still.count()}, at, gradient, pool, moving_gradient);
  gradient.Resize(still.count());
}

void DensifyParts(const GradientDensifyOptions& options, DensifyTarget& still, MovingPart& moving) {
  if (moving.parameters.count() == 0) return DensifyByGradient(options, still);
  const int64_t first = still.parameters.count();
  const int64_t count = first + moving.parameters.count();
  const int64_t room = std::max<int64_t>(0, options.max_gaussians - count);
  const DensifyStatistics all = still.statistics;
  GradientDensifyOptions part = options;
  DensifyStatistics of_moving = Part(all, first, count);
  DensifyTarget target{moving.parameters, moving.moments, of_moving, still.random};
  part.max_gaussians = moving.parameters.count() + room * moving.parameters.count() / count;
  DensifyByGradient(part, target);
  still.statistics = Part(all, 0, first);
  part.max_gaussians = std::max(first, options.max_gaussians - moving.parameters.count());
  DensifyByGradient(part, still);
  still.statistics.Reset(still.parameters.count() + moving.parameters.count());
}

GaussianModel ModelOfParts(const ParameterBlock& still,
                           const MovingPart& moving,
                           const TimeSpan& times,
                           const ColorLayout& layout) {
  const int64_t first = still.count(), count = moving.parameters.count();
  ParameterBlock all = still;
  all.Resize(first + count);
  for (int row = 0; row < still.rows() && count > 0; ++row) {
    std::copy_n(moving.parameters.Row(row), count, all.Row(row) + first);
  }
  GaussianModel model = ModelFromParameters(all, layout);
  if (count == 0) return model;
  model.motion.begin_s = times.begin_s;
  model.motion.end_s = times.end_s;
  SetMotion(moving.parameters, still.rows(), model.motion);
  return model;
}

}  // namespace color3d
