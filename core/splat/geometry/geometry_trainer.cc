#include "core/splat/geometry/geometry_trainer.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "core/base/error.h"
#include "core/splat/geometry/densify.h"
#include "core/splat/model/model_parameters.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/raster/pipeline.h"
#include "core/splat/training/held_out.h"
#include "core/splat/training/loss.h"
#include "core/splat/training/regularize.h"
#include "core/splat/training/training_guard.h"
#include "core/splat/training/training_state.h"
#include "core/splat/training/training_targets.h"

namespace color3d {
namespace {

constexpr int64_t kTargetBudgetBytes = int64_t{512} << 20;
constexpr double kErrorReports = 100.0;
constexpr int64_t kMinDensifyInterval = 10;  // iterations: fewer say little about gradients
constexpr double kHeldOutMoments[] = {0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 1.0};
constexpr float kBackground[3] = {0.0f, 0.0f, 0.0f};

// An evenly spaced part when there are more than the cap allows.
ParameterBlock AtMost(int64_t count, ParameterBlock p) {
  if (p.count() <= count) return p;
  std::vector<uint32_t> kept(count);
  for (int64_t i = 0; i < count; ++i) kept[i] = static_cast<uint32_t>(i * p.count() / count);
  p.Gather(kept);
  return p;
}

// Spherical harmonics of `from`, channel by channel, cut or extended to `coefficients` each. A
// single channel serves for all.
ParameterBlock WithColours(const GaussianModel& from, int channels, int coefficients) {
  const ParameterBlock given = ParametersFromModel(from);
  const int first = ShCoefficients(from.sh_degree), other = ShCoefficients(from.chroma_sh_degree);
  ParameterBlock p(kColorRow + channels * coefficients, given.count());
  for (int r = 0; r < kColorRow; ++r) std::copy_n(given.Row(r), given.count(), p.Row(r));
  for (int c = 0; c < channels; ++c) {
    const int source = std::min(c, from.channels - 1);
    const int row = kColorRow + (source == 0 ? 0 : first + (source - 1) * other);
    for (int k = 0; k < std::min(coefficients, source == 0 ? first : other); ++k) {
      std::copy_n(given.Row(row + k), given.count(), p.Row(kColorRow + c * coefficients + k));
    }
  }
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
        schedule_(options, tuning, problem.extent),
        channels_(problem.colours ? 3 : 1),
        pool_(pool),
        progress_(progress),
        targets_(problem.colours ? problem.colours : problem.luminance,
                 channels_,
                 problem.colours ? 1.0f : 0.01f,
                 kTargetBudgetBytes) {
    state_.parameters = AtMost(options.max_gaussians,
                               WithColours(initial, channels_, ShCoefficients(options.sh_degree)));
    const int rows = state_.parameters.rows();
    initial_count_ = state_.parameters.count();
    state_.moments = {ParameterBlock(rows, initial_count_), ParameterBlock(rows, initial_count_)};
    state_.statistics.Reset(initial_count_);
    state_.random = Random(options.seed);
    pipeline_.set_clock(&clock_);
  }

  GaussianModel Train(CheckpointStore& checkpoints,
                      const CancellationToken& cancel,
                      TrainingTrace* trace) {
    trace_ = trace;
    TrainingGuard guard(progress_);
    Resume(checkpoints);
    guard.Keep(state_);
    earlier_seconds_ = state_.elapsed_seconds;
    timed_from_ = state_.iteration;
    fraction_ = FractionNow();
    while (fraction_ < 1.0) {
      cancel.ThrowIfCancelled();
      if (!Step()) {
        guard.Restore("geometry", state_);
        fraction_ = FractionNow();
        continue;
      }
      ++state_.iteration;
      const double before = fraction_;
      fraction_ = FractionNow();
      clock_.Enter(Phase::kDensify);
      Densify(before);
      clock_.Enter(Phase::kOther);
      if (guard.IsDue(state_.iteration)) guard.Keep(state_);
      Report(before);
      if (checkpoints.WantsSave()) {
        state_.elapsed_seconds = earlier_seconds_ + clock_.TrainingSeconds();
        checkpoints.Save(SerializeTrainingState(state_, Fingerprint()));
      }
    }
    FinishTrace();
    const int chroma_degree = channels_ == 3 ? options_.sh_degree : 0;
    return ModelFromParameters(state_.parameters, channels_, options_.sh_degree, chroma_degree);
  }

 private:
  double FractionNow() {
    return schedule_.Fraction(state_.iteration, earlier_seconds_ + clock_.TrainingSeconds());
  }

  // Everything that the course of training depends on.
  std::string Fingerprint() const {
    char text[256];
    std::snprintf(text,
                  sizeof(text),
                  "geometry %d %d %d %d %d %g %g %g %g %g %llu %zu %zu %lld",
                  channels_,
                  static_cast<int>(options_.recipe),
                  options_.iterations,
                  options_.max_gaussians,
                  options_.sh_degree,
                  options_.time_limit_seconds,
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
          "geometry: the checkpoint belongs to other options or is damaged; training starts "
          "afresh");
    }
  }

  RasterCamera CameraAt(const PosedCamera& view, int level) const {
    return MakeRasterCamera(view.camera.Scaled(SizeAtLevel(view.camera.width, level),
                                               SizeAtLevel(view.camera.height, level)),
                            view.cam_from_world);
  }

  ColorSpec Colours() const {
    ColorSpec spec;
    spec.channels = channels_;
    for (int c = 0; c < channels_; ++c) {
      spec.channel[c] = {kColorRow + c * ShCoefficients(options_.sh_degree),
                         ShCoefficients(schedule_.ActiveDegree(fraction_)),
                         0.5f,
                         true};
    }
    return spec;
  }

  // One iteration. False when something was not finite.
  bool Step() {
    const PosedCamera& view =
        problem_.training[state_.NextView(static_cast<int>(problem_.training.size()))];
    const int level = schedule_.Level(fraction_, view.camera);
    const std::shared_ptr<const PlaneBuffer> target = targets_.Get(view, level);
    const RasterCamera camera = CameraAt(view, level);
    const ColorSpec color = Colours();
    pipeline_.Forward(state_.parameters, color, camera, kBackground, false, pool_);
    LossWeights weights;
    weights.ssim = static_cast<float>(options_.ssim_weight);
    weights.l1 = 1.0f - weights.ssim;
    weights.edge = static_cast<float>(options_.edge_weight);
    clock_.Enter(Phase::kLoss);
    const LossValue loss =
        loss_.Evaluate(pipeline_.color(), *target, nullptr, weights, pool_, d_color_);
    if (!std::isfinite(loss.total)) return false;
    state_.statistics.absolute = tuning_.absolute_gradient;
    pipeline_.Backward(state_.parameters,
                       color,
                       camera,
                       d_color_,
                       GradientScope::kAll,
                       pool_,
                       gradient_,
                       &state_.statistics);
    if (!Update()) return false;
    state_.mean_error += (state_.mean_error == 0.0 ? 1.0 : 0.02) * (loss.l1 - state_.mean_error);
    return true;
  }

  // Parameters from the gradient. False when something was not finite.
  bool Update() {
    clock_.Enter(Phase::kAdam);
    if (tuning_.opacity_penalty > 0.0 || tuning_.scale_penalty > 0.0) {
      AddPenaltyGradients(state_.parameters,
                          static_cast<float>(tuning_.opacity_penalty),
                          static_cast<float>(tuning_.scale_penalty / problem_.extent),
                          pool_,
                          gradient_);
    }
    std::vector<float> rates = schedule_.LearningRates(fraction_, channels_);
    for (float& rate : rates) rate *= static_cast<float>(state_.rate_scale);
    if (!AdamStep(gradient_,
                  rates,
                  state_.iteration + 1,
                  pool_,
                  state_.parameters,
                  state_.moments,
                  tuning_.sparse_adam ? &pipeline_.depth_keys() : nullptr)) {
      return false;
    }
    if (tuning_.max_needle_ratio > 0.0) {
      LimitNeedles(
          static_cast<float>(std::log(tuning_.max_needle_ratio)), pool_, state_.parameters);
    }
    if (tuning_.strategy == GeometryTuning::Strategy::kRelocate && tuning_.noise > 0.0 &&
        fraction_ < tuning_.densify_until) {
      AddPositionNoise(static_cast<float>(tuning_.noise * rates[kPositionRow]),
                       state_.random.NextUint32(),
                       pool_,
                       state_.parameters);
    }
    clock_.Enter(Phase::kOther);
    return true;
  }

  // How many Gaussians there may be after this round.
  int64_t CountAllowed() {
    const double now = clock_.TrainingSeconds();
    const double each = (now - densified_seconds_) /
                        static_cast<double>(std::max<int64_t>(1, state_.iteration - timed_from_));
    densified_seconds_ = now;
    timed_from_ = state_.iteration;
    const int level = schedule_.Level(fraction_, problem_.training.front().camera);
    const int64_t affordable = schedule_.AffordableCount(
        fraction_, state_.iteration, each, level, state_.parameters.count());
    const bool scheduled =
        tuning_.scheduled_cap || tuning_.strategy == GeometryTuning::Strategy::kRelocate;
    return scheduled ? std::min(affordable, schedule_.TargetCount(fraction_, initial_count_))
                     : affordable;
  }

  void Densify(double before) {
    DensifyTarget target{state_.parameters, state_.moments, state_.statistics, state_.random};
    if (schedule_.DensifyDue(before, fraction_) &&
        state_.iteration - state_.densified_at >= kMinDensifyInterval) {
      state_.densified_at = state_.iteration;
      const int64_t allowed = CountAllowed();
      if (tuning_.strategy == GeometryTuning::Strategy::kRelocate) {
        RelocationOptions relocation;
        relocation.gradient_preference = tuning_.gradient_preference;
        relocation.target_count = std::max(state_.parameters.count(), allowed);
        Relocate(relocation, target);
      } else {
        GradientDensifyOptions densify;
        densify.gradient_threshold = options_.densify_gradient;
        densify.clone_below_scale = 0.01 * problem_.extent;
        densify.max_gaussians = allowed;
        if (tuning_.prune_scale > 0.0 && schedule_.HasReset(fraction_)) {
          densify.prune_scale = tuning_.prune_scale * problem_.extent;
        }
        DensifyByGradient(densify, target);
      }
    }
    if (schedule_.OpacityResetDue(before, fraction_)) ResetOpacity(0.01, target);
  }

  std::string Named(const char* what, const char* unit = "") const {
    return std::string(what) + (channels_ == 3 ? "_rgb" : "_l") + unit;
  }

  void Report(double before) {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_progress_ > std::chrono::milliseconds(250) || fraction_ >= 1.0) {
      last_progress_ = now;
      const Camera& camera = problem_.training.front().camera;
      const int level = schedule_.Level(fraction_, camera);
      progress_.OnProgress(
          state_.iteration,
          std::llround(static_cast<double>(state_.iteration) / std::max(fraction_, 1e-9)),
          "geometry, " + std::to_string(state_.parameters.count()) + " Gaussians at " +
              std::to_string(SizeAtLevel(camera.width, level)) + "x" +
              std::to_string(SizeAtLevel(camera.height, level)) + " px");
    }
    if (std::floor(fraction_ * kErrorReports) > std::floor(before * kErrorReports)) {
      progress_.OnError(state_.iteration, Named("train_l1"), state_.mean_error);
    }
    for (const double moment : kHeldOutMoments) {
      if (before < moment && fraction_ >= moment) {
        ReportHeldOut();
        break;
      }
    }
  }

  // Means over the held-out views; no part of training's time.
  void ReportHeldOut() {
    if (problem_.held_out.empty()) return;
    HeldOutPoint point;
    point.seconds = earlier_seconds_ + clock_.TrainingSeconds();
    point.iteration = state_.iteration;
    point.gaussians = state_.parameters.count();
    pipeline_.set_clock(nullptr);
    clock_.Enter(Phase::kEvaluation);
    const double each = 1.0 / static_cast<double>(problem_.held_out.size());
    for (const PosedCamera& view : problem_.held_out) {
      const std::shared_ptr<const PlaneBuffer> target = targets_.Get(view, 0);
      pipeline_.Forward(state_.parameters, Colours(), CameraAt(view, 0), kBackground, false, pool_);
      PlaneBuffer drawn = pipeline_.color();
      const PictureQuality quality = CompareClamped(*target, loss_, pool_, drawn);
      point.psnr_db += each * quality.psnr_db;
      point.ssim += each * quality.ssim;
      point.l1 += each * quality.l1;
      if (fraction_ >= 1.0 && trace_ != nullptr && trace_->on_held_out_picture) {
        trace_->on_held_out_picture(view.view, ImageFromPlanes(drawn));
      }
    }
    progress_.OnError(state_.iteration, Named("heldout_psnr", "_db"), point.psnr_db);
    if (trace_ != nullptr) trace_->held_out.push_back(point);
    clock_.Enter(Phase::kOther);
    pipeline_.set_clock(&clock_);
  }

  void FinishTrace() {
    if (trace_ == nullptr) return;
    trace_->seconds = clock_.TrainingSeconds();
    trace_->phases = clock_.seconds();
    trace_->iterations = state_.iteration;
    trace_->gaussians = state_.parameters.count();
  }

  const GeometryProblem& problem_;
  const GeometryOptions& options_;
  const GeometryTuning& tuning_;
  TrainingSchedule schedule_;
  int channels_;
  ThreadPool& pool_;
  ProgressObserver& progress_;
  TrainingTargets targets_;
  TrainingState state_;
  int64_t initial_count_ = 0;
  double fraction_ = 0.0;  // of the schedule that is done
  double earlier_seconds_ = 0.0;
  PhaseClock clock_;
  double densified_seconds_ = 0.0;  // on the clock, and the iteration, of the last round
  int64_t timed_from_ = 0;
  SplatPipeline pipeline_;
  ImageLoss loss_;
  PlaneBuffer d_color_;
  ParameterBlock gradient_;
  TrainingTrace* trace_ = nullptr;
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
                              const CancellationToken& cancel,
                              TrainingTrace* trace) {
  options.Validate();
  if (problem.training.empty()) {
    throw InvalidArgument("the scene has no training views; give at least one posed photo");
  }
  GeometryTrainer trainer(problem, initial, options, tuning, pool, progress);
  return trainer.Train(checkpoints, cancel, trace);
}

}  // namespace color3d
