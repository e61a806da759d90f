#include "core/splat/geometry_trainer.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>

#include "core/base/error.h"
#include "core/splat/densify.h"
#include "core/splat/loss.h"
#include "core/splat/model_parameters.h"
#include "core/splat/pipeline.h"
#include "core/splat/regularize.h"
#include "core/splat/spherical_harmonics.h"
#include "core/splat/training_guard.h"
#include "core/splat/training_state.h"
#include "core/splat/training_targets.h"

namespace color3d {
namespace {

constexpr int64_t kTargetBudgetBytes = int64_t{512} << 20;
constexpr int kMinTrainingSidePx = 64;  // coarser levels are not used below this
constexpr int kErrorReports = 100;
constexpr double kHeldOutMoments[] = {0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 1.0};

// An evenly spaced part when there are more than the cap allows.
ParameterBlock AtMost(int64_t count, ParameterBlock p) {
  if (p.count() <= count) return p;
  std::vector<uint32_t> kept(count);
  for (int64_t i = 0; i < count; ++i) kept[i] = static_cast<uint32_t>(i * p.count() / count);
  p.Gather(kept);
  return p;
}

class GeometryTrainer {
 public:
  GeometryTrainer(const GeometryProblem& problem,
                  const GaussianModel& initial,
                  const GeometryOptions& options,
                  const GeometryTuning& tuning,
                  ThreadPool& pool,
                  ProgressObserver& progress)
      : problem_(problem),
        options_(options),
        tuning_(tuning),
        pool_(pool),
        progress_(progress),
        targets_(problem.luminance, kTargetBudgetBytes) {
    const ParameterBlock from = AtMost(options.max_gaussians, ParametersFromModel(initial));
    const int rows = kColorRow + ShCoefficients(options.sh_degree);
    state_.parameters = ParameterBlock(rows, from.count());
    for (int r = 0; r < std::min(rows, from.rows()); ++r) {
      std::copy_n(from.Row(r), from.count(), state_.parameters.Row(r));
    }
    state_.moments = {ParameterBlock(rows, from.count()), ParameterBlock(rows, from.count())};
    state_.statistics.Reset(from.count());
    state_.random = Random(options.seed);
    initial_count_ = from.count();
  }

  GaussianModel Train(CheckpointStore& checkpoints, const CancellationToken& cancel) {
    TrainingGuard guard(progress_);
    Resume(checkpoints);
    guard.Keep(state_);
    const double resumed_seconds = state_.elapsed_seconds;
    const auto start = std::chrono::steady_clock::now();
    while (state_.iteration < options_.iterations) {
      cancel.ThrowIfCancelled();
      if (!Step()) {
        guard.Restore("luminance geometry", state_);
        continue;
      }
      ++state_.iteration;
      Densify();
      if (guard.IsDue(state_.iteration)) guard.Keep(state_);
      Report();
      if (checkpoints.WantsSave()) {
        state_.elapsed_seconds =
            resumed_seconds +
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        checkpoints.Save(SerializeTrainingState(state_, Fingerprint()));
      }
    }
    return ModelFromParameters(state_.parameters, 1, options_.sh_degree, 0);
  }

 private:
  double Fraction() const {
    return static_cast<double>(state_.iteration) / std::max(1, options_.iterations);
  }

  // Everything that the course of training depends on.
  std::string Fingerprint() const {
    char text[256];
    std::snprintf(text,
                  sizeof(text),
                  "geometry %d %d %d %g %g %g %g %llu %zu %zu %lld",
                  options_.iterations,
                  options_.max_gaussians,
                  options_.sh_degree,
                  options_.ssim_weight,
                  options_.edge_weight,
                  options_.densify_gradient,
                  options_.learning_rate_scale,
                  static_cast<unsigned long long>(options_.seed),
                  problem_.training.size(),
                  problem_.held_out.size(),
                  static_cast<long long>(initial_count_));
    return text;
  }

  void Resume(CheckpointStore& checkpoints) {
    const std::optional<std::string> saved = checkpoints.Load();
    if (saved && !ParseTrainingState(*saved, Fingerprint(), state_)) {
      progress_.OnWarning(
          "luminance geometry: the checkpoint belongs to other options or is damaged; training "
          "starts afresh");
    }
  }

  int Level(const Camera& camera) const {
    const double f = Fraction();
    int level = f < tuning_.quarter_size_until ? 2 : f < tuning_.half_size_until ? 1 : 0;
    const int side = std::min(camera.width, camera.height);
    while (level > 0 && side >> level < kMinTrainingSidePx) --level;
    return level;
  }

  int ActiveDegree() const {
    const double since = Fraction() - tuning_.sh_from;
    if (since < 0.0) return 0;
    return std::min(options_.sh_degree, 1 + static_cast<int>(since / tuning_.sh_step));
  }

  double PositionRate() const {
    const double f = Fraction();
    return problem_.extent * std::exp((1.0 - f) * std::log(tuning_.position_rate_first) +
                                      f * std::log(tuning_.position_rate_last));
  }

  std::vector<float> LearningRates() const {
    const double scale = options_.learning_rate_scale * state_.rate_scale;
    std::vector<float> rates(state_.parameters.rows(), 0.0f);
    const auto set = [&](int row, int count, double rate) {
      std::fill_n(rates.begin() + row, count, static_cast<float>(scale * rate));
    };
    set(kPositionRow, 3, PositionRate());
    set(kLogScaleRow, 3, tuning_.scale_rate);
    set(kRotationRow, 4, tuning_.rotation_rate);
    set(kOpacityRow, 1, tuning_.opacity_rate);
    set(kColorRow, 1, tuning_.dc_rate);
    set(kColorRow + 1, ShCoefficients(ActiveDegree()) - 1, tuning_.dc_rate / tuning_.rest_divisor);
    return rates;
  }

  RasterCamera CameraAt(const PosedCamera& view, int level) const {
    return MakeRasterCamera(view.camera.Scaled(SizeAtLevel(view.camera.width, level),
                                               SizeAtLevel(view.camera.height, level)),
                            view.cam_from_world);
  }

  // One iteration. False when something was not finite.
  bool Step() {
    const PosedCamera& view =
        problem_.training[state_.NextView(static_cast<int>(problem_.training.size()))];
    const int level = Level(view.camera);
    const std::shared_ptr<const PlaneBuffer> target = targets_.Get(view, level);
    const RasterCamera camera = CameraAt(view, level);
    ColorSpec color = ColorSpecOf(1, ActiveDegree(), 0);
    const float background = 0.0f;
    pipeline_.Forward(state_.parameters, color, camera, &background, false, pool_);
    LossWeights weights;
    weights.ssim = static_cast<float>(options_.ssim_weight);
    weights.l1 = 1.0f - weights.ssim;
    weights.edge = static_cast<float>(options_.edge_weight);
    const LossValue loss =
        loss_.Evaluate(pipeline_.color(), *target, nullptr, weights, pool_, d_color_);
    if (!std::isfinite(loss.total)) return false;
    pipeline_.Backward(state_.parameters,
                       color,
                       camera,
                       d_color_,
                       GradientScope::kAll,
                       pool_,
                       gradient_,
                       &state_.statistics);
    AddPenaltyGradients(state_.parameters,
                        static_cast<float>(tuning_.opacity_penalty),
                        static_cast<float>(tuning_.scale_penalty / problem_.extent),
                        pool_,
                        gradient_);
    if (!AdamStep(gradient_,
                  LearningRates(),
                  state_.iteration + 1,
                  pool_,
                  state_.parameters,
                  state_.moments)) {
      return false;
    }
    if (tuning_.strategy == GeometryTuning::Strategy::kRelocate && tuning_.noise > 0.0 &&
        Fraction() < tuning_.densify_until) {
      AddPositionNoise(static_cast<float>(tuning_.noise * PositionRate() *
                                          options_.learning_rate_scale * state_.rate_scale),
                       state_.random.NextUint32(),
                       pool_,
                       state_.parameters);
    }
    state_.mean_error += (state_.mean_error == 0.0 ? 1.0 : 0.02) * (loss.l1 - state_.mean_error);
    return true;
  }

  void Densify() {
    const double n = options_.iterations;
    const double from = tuning_.densify_from * n, until = tuning_.densify_until * n;
    const int64_t interval = std::max<int64_t>(
        10, static_cast<int64_t>((until - from) / std::max(1, tuning_.densify_rounds)));
    const double at = static_cast<double>(state_.iteration);
    if (at < from || at > until || state_.iteration % interval != 0) return;
    DensifyTarget target{state_.parameters, state_.moments, state_.statistics, state_.random};
    if (tuning_.strategy == GeometryTuning::Strategy::kRelocate) {
      RelocationOptions relocation;
      relocation.gradient_preference = tuning_.gradient_preference;
      relocation.target_count = std::max(state_.parameters.count(), TargetCount());
      Relocate(relocation, target);
      return;
    }
    GradientDensifyOptions densify;
    densify.gradient_threshold = options_.densify_gradient;
    densify.clone_below_scale = 0.01 * problem_.extent;
    densify.max_gaussians = options_.max_gaussians;
    DensifyByGradient(densify, target);
    const int64_t round = static_cast<int64_t>((at - from) / static_cast<double>(interval));
    if (tuning_.opacity_resets > 0 && round > 0 &&
        round % std::max(1, tuning_.densify_rounds / (tuning_.opacity_resets + 1)) == 0) {
      ResetOpacity(0.01, target);
    }
  }

  // Geometric growth from the initial count to the cap.
  int64_t TargetCount() const {
    const double progress =
        std::clamp((Fraction() - tuning_.densify_from) /
                       std::max(1e-9, tuning_.growth_until - tuning_.densify_from),
                   0.0,
                   1.0);
    const double first = static_cast<double>(initial_count_);
    const double last = std::max<double>(first, options_.max_gaussians);
    return std::min<int64_t>(static_cast<int64_t>(first * std::pow(last / first, progress)),
                             std::max<int64_t>(options_.max_gaussians, initial_count_));
  }

  void Report() {
    const int64_t n = options_.iterations;
    const auto now = std::chrono::steady_clock::now();
    if (now - last_progress_ > std::chrono::milliseconds(250) || state_.iteration == n) {
      last_progress_ = now;
      const Camera& camera = problem_.training.front().camera;
      const int level = Level(camera);
      progress_.OnProgress(state_.iteration,
                           n,
                           "luminance geometry, " + std::to_string(state_.parameters.count()) +
                               " Gaussians at " + std::to_string(SizeAtLevel(camera.width, level)) +
                               "x" + std::to_string(SizeAtLevel(camera.height, level)) + " px");
    }
    if (state_.iteration % std::max<int64_t>(1, n / kErrorReports) == 0 || state_.iteration == n) {
      progress_.OnError(state_.iteration, "train_l1_l", state_.mean_error);
    }
    for (const double moment : kHeldOutMoments) {
      if (state_.iteration == std::max<int64_t>(1, std::llround(moment * static_cast<double>(n)))) {
        ReportHeldOut();
        break;
      }
    }
  }

  // Mean over the held-out views of the PSNR of L (peak 100).
  void ReportHeldOut() {
    if (problem_.held_out.empty()) return;
    double sum = 0.0;
    for (const PosedCamera& view : problem_.held_out) {
      const std::shared_ptr<const PlaneBuffer> target = targets_.Get(view, 0);
      const float background = 0.0f;
      pipeline_.Forward(state_.parameters,
                        ColorSpecOf(1, ActiveDegree(), 0),
                        CameraAt(view, 0),
                        &background,
                        false,
                        pool_);
      double squares = 0.0;
      for (int y = 0; y < target->height; ++y) {
        const float *a = pipeline_.color().Row(0, y), *b = target->Row(0, y);
        for (int x = 0; x < target->width; ++x) {
          squares += static_cast<double>(a[x] - b[x]) * (a[x] - b[x]);
        }
      }
      const double mse = squares / (static_cast<double>(target->width) * target->height);
      sum += std::min(99.0, -10.0 * std::log10(std::max(mse, 1e-12)));
    }
    progress_.OnError(
        state_.iteration, "heldout_psnr_l_db", sum / static_cast<double>(problem_.held_out.size()));
  }

  const GeometryProblem& problem_;
  const GeometryOptions& options_;
  const GeometryTuning& tuning_;
  ThreadPool& pool_;
  ProgressObserver& progress_;
  TrainingTargets targets_;
  TrainingState state_;
  int64_t initial_count_ = 0;
  SplatPipeline pipeline_;
  ImageLoss loss_;
  PlaneBuffer d_color_;
  ParameterBlock gradient_;
  std::chrono::steady_clock::time_point last_progress_;
};

}  // namespace

GaussianModel TrainGeometryOn(const GeometryProblem& problem,
                              const GaussianModel& initial,
                              const GeometryOptions& options,
                              const GeometryTuning& tuning,
                              ThreadPool& pool,
                              CheckpointStore& checkpoints,
                              ProgressObserver& progress,
                              const CancellationToken& cancel) {
  options.Validate();
  if (problem.training.empty()) {
    throw InvalidArgument("the scene has no training views; give at least one posed photo");
  }
  GeometryTrainer trainer(problem, initial, options, tuning, pool, progress);
  return trainer.Train(checkpoints, cancel);
}

}  // namespace color3d
