#include "core/splat/geometry/warm_up.h"

#include <algorithm>
#include <utility>

#include "core/base/error.h"
#include "core/splat/geometry/first_parameters.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/motion/motion.h"

namespace color3d {
namespace {

constexpr std::string_view kFingerprint = "warm-up 1";  // counts versions of the format

// Options that the second part depends on. The tuning is stored, so that a training keeps the
// schedule that it began with.
template <class Archive, class WarmUpOrConst>
void VisitWarmUp(Archive& archive, WarmUpOrConst& warm_up) {
  auto& options = warm_up.options;
  archive.Value(options.recipe);
  archive.Value(options.motion);
  archive.Value(options.deformation);
  archive.Value(options.iterations);
  archive.Value(options.time_limit_seconds);
  archive.Value(options.max_gaussians);
  archive.Value(options.sh_degree);
  archive.Value(options.ssim_weight);
  archive.Value(options.edge_weight);
  archive.Value(options.densify_gradient);
  archive.Value(options.learning_rate_scale);
  archive.Value(options.warm_up);
  archive.Value(options.seed);
  VisitFields(*options.tuning, [&](const char*, auto& value) { archive.Value(value); });
  archive.Value(warm_up.max_side_px);
  archive.Value(warm_up.picture_cache_bytes);
  VisitGeometryState(archive, warm_up.state);
}

// Rows of `from`: geometry, L', and `trailing` others. `shift`: added to the constant of a' and b'.
ParameterBlock Extended(const ParameterBlock& from,
                        const ColorLayout& luminance,
                        const ColorLayout& layout,
                        float shift) {
  const int trailing = from.rows() - luminance.rows();
  ParameterBlock to(layout.rows() + trailing, from.count());
  const auto copy = [&](int source, int target, int rows) {
    for (int r = 0; r < rows; ++r)
      std::copy_n(from.Row(source + r), from.count(), to.Row(target + r));
  };
  copy(0, 0, kColorRow);
  for (int c = 0; c < layout.channels; ++c) {
    copy(kColorRow, layout.Row(c), std::min(luminance.Coefficients(0), layout.Coefficients(c)));
    if (c == 0) continue;
    float* constant = to.Row(layout.Row(c));
    for (int64_t i = 0; i < to.count(); ++i) constant[i] += shift;
  }
  copy(luminance.rows(), layout.rows(), trailing);
  return to;
}

GeometryState UntrainedState(const GaussianModel& from,
                             int channels,
                             const GeometryOptions& options) {
  GeometryState state;
  state.parameters =
      FirstParameters(from, channels, ShCoefficients(options.sh_degree), options.max_gaussians);
  const ParameterBlock zeros = state.parameters.ZerosOfSameShape();
  state.moments = {zeros, zeros};
  state.statistics.Reset(state.parameters.count());
  state.random = Random(options.seed);
  return state;
}

// Adds the deformation, unless the state has one or needs none.
GeometryState WithHexPlanes(GeometryState state,
                            const GeometryProblem& problem,
                            const GeometryOptions& options) {
  const TimeSpan times = TimeSpanOf(problem);
  if (options.deformation != GeometryOptions::Deformation::kHexPlane ||
      options.motion != GeometryOptions::Motion::kAuto || times.steps < 2 ||
      !state.hexplane.empty()) {
    return state;
  }
  state.hexplane = FirstHexPlanes(state.parameters,
                                  {times.begin_s, times.end_s, times.steps},
                                  problem.extent,
                                  TuningOf(options).hexplane,
                                  options.seed);
  return state;
}

}  // namespace

std::string SerializeWarmUp(const WarmUp& warm_up) {
  CheckpointWriter writer(kFingerprint);
  if (warm_up.options.tuning) {
    VisitWarmUp(writer, warm_up);
  } else {
    throw Error(ErrorCode::kInternal, "a warm-up is saved without its tuning");
  }
  return std::move(writer).Finish();
}

WarmUp ParseWarmUp(std::string_view bytes) {
  CheckpointReader reader(bytes, kFingerprint);
  WarmUp warm_up;
  warm_up.options.tuning.emplace();
  if (reader.ok()) VisitWarmUp(reader, warm_up);
  if (!reader.ok()) {
    throw InvalidArgument(
        "the training state of {} bytes is damaged or of another version; reconstruct the geometry "
        "again",
        bytes.size());
  }
  warm_up.options.Validate();
  return warm_up;
}

GeometryState FirstState(const GeometryProblem& problem,
                         const GeometryOptions& options,
                         const ColorLayout& layout) {
  if (problem.start == nullptr) {
    GeometryState state = UntrainedState(problem.initial, layout.channels, options);
    if (TuningOf(options).exposure_rate > 0.0) state.exposures.resize(problem.training.size());
    return WithHexPlanes(std::move(state), problem, options);
  }
  const GeometryState& start = *problem.start;
  const ColorLayout luminance{ColorSpace::kLab, 1, options.sh_degree, 0};
  const size_t views = start.order.views.size();
  if (start.parameters.rows() != luminance.rows() ||
      (views != 0 && views != problem.training.size())) {
    throw InvalidArgument(
        "the warm-up is of {} views and {} numbers a Gaussian, the scene has {} and {}; "
        "reconstruct the geometry again",
        views,
        start.parameters.rows(),
        problem.training.size(),
        luminance.rows());
  }
  return WithHexPlanes(
      layout.channels == 1 ? start : WithChromaFromLuminance(start, options.sh_degree, layout),
      problem,
      options);
}

GeometryState StateOf(const GaussianModel& geometry, const GeometryOptions& options) {
  GeometryState state = UntrainedState(geometry, 1, options);
  state.iteration = static_cast<int64_t>(options.warm_up * options.iterations);
  return state;
}

GeometryState WithChromaFromLuminance(const GeometryState& warm_up,
                                      int sh_degree,
                                      const ColorLayout& layout) {
  const ColorLayout luminance{ColorSpace::kLab, 1, sh_degree, 0};
  // a' and b' have another base than L': their first value is the same.
  const float shift = (layout.Base(0) - layout.Base(1)) / kShDc;
  const auto extend = [&](ParameterBlock& parameters, AdamMoments& moments) {
    if (parameters.rows() == 0) return;
    parameters = Extended(parameters, luminance, layout, shift);
    moments.first = Extended(moments.first, luminance, layout, 0.0f);
    moments.second = Extended(moments.second, luminance, layout, 0.0f);
  };
  GeometryState state = warm_up;
  extend(state.parameters, state.moments);
  extend(state.moving.parameters, state.moving.moments);
  state.mean_error = 0.0;  // of chroma from now on
  return state;
}

}  // namespace color3d
