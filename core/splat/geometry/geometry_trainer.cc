#include "core/splat/geometry/geometry_trainer.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "core/base/error.h"
#include "core/scene/photo_masks.h"
#include "core/splat/geometry/geometry_state.h"
#include "core/splat/geometry/held_out.h"
#include "core/splat/geometry/moving_part.h"
#include "core/splat/geometry/picture_loss.h"
#include "core/splat/geometry/regularize.h"
#include "core/splat/geometry/training_schedule.h"
#include "core/splat/geometry/warm_up.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/motion/motion.h"
#include "core/splat/motion/shared_motion.h"
#include "core/splat/raster/pipeline.h"
#include "core/splat/raster/raster_camera.h"
#include "core/splat/training/hexplane_training.h"
#include "core/splat/training/training_guard.h"
#include "core/splat/training/training_targets.h"

namespace color3d {
namespace {

constexpr double kErrorReports = 100.0;
constexpr int64_t kMinDensifyInterval = 10;  // iterations: gradients of fewer are noise
constexpr double kHeldOutMoments[] = {0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 1.0};
constexpr double kSurveyAt = 0.15;  // fraction of the schedule at which motion is searched for
constexpr double kAbUnits = 255.0;  // Lab units of 1 in a' and b'

class GeometryTrainer {
 public:
  GeometryTrainer(const GeometryProblem& problem,
                  const GeometryOptions& options,
                  const RunControl& run,
                  TrainingTrace* trace)
      : problem_(problem),
        options_(options),
        run_(run),
        trace_(trace),
        schedule_(options, problem.extent, problem.is_relief),
        times_(TimeSpanOf(problem)),
        layout_(TrainedLayout(problem, options)),
        end_(layout_.channels == 1 ? options.warm_up : 1.0),
        targets_(problem.colors ? problem.colors : problem.luminance,
                 layout_.channels,
                 problem.colors ? 1.0f : 0.01f,
                 problem.picture_cache_bytes),
        masks_(problem.mask, 1, 1.0f, problem.picture_cache_bytes / 4, ResizeMask),
        still_(problem.still, 1, 1.0f, problem.picture_cache_bytes / 4, ResizeMask),
        hexplanes_(schedule_.tuning().hexplane, problem.is_relief),
        state_(FirstState(problem, options, layout_)),
        loss_(options, layout_) {
    initial_count_ = state_.parameters.count();
    pipeline_.set_clock(&clock_);
  }

  GaussianModel Train() {
    TrainingGuard<GeometryState> guard("geometry", run_.progress);
    Resume();
    guard.Keep(state_);
    earlier_seconds_ = state_.elapsed_seconds;
    last_round_.iteration = state_.iteration;
    fraction_ = FractionNow();
    while (fraction_ < end_) {
      run_.cancel.ThrowIfCancelled();
      if (!Step()) {
        guard.Restore(state_);
        fraction_ = FractionNow();
        continue;
      }
      ++state_.iteration;
      const double before = fraction_;
      fraction_ = FractionNow();
      clock_.Enter(Phase::kDensify);
      if (before < kSurveyAt && fraction_ >= kSurveyAt) FindMovers();
      Densify(before);
      clock_.Enter(Phase::kOther);
      if (guard.IsDue(state_.iteration)) guard.Keep(state_);
      Report(before);
      if (run_.checkpoints.WantsSave()) {
        state_.elapsed_seconds = earlier_seconds_ + clock_.TrainingSeconds();
        run_.checkpoints.Save(SerializeGeometryState(state_, Fingerprint()));
      }
    }
    FinishTrace();
    state_.elapsed_seconds = earlier_seconds_ + clock_.TrainingSeconds();
    GaussianModel model = ModelOfParts(state_.parameters, state_.moving, times_, layout_);
    model.hexplane = FieldOf(state_.hexplane);
    return model;
  }

  // The state at the end of Train().
  GeometryState TakeState() { return std::move(state_); }

 private:
  double FractionNow() {
    return schedule_.Fraction(state_.iteration, earlier_seconds_ + clock_.TrainingSeconds());
  }

  std::string Fingerprint() const {
    return GeometryFingerprint(problem_, options_, IsAuto() ? times_.steps : 1, initial_count_);
  }

  void Resume() {
    const std::optional<std::string> saved = run_.checkpoints.Load();
    if (saved && !ParseGeometryState(*saved, Fingerprint(), state_)) {
      run_.progress.OnWarning(
          "geometry: the checkpoint belongs to other options or is damaged; training starts "
          "afresh");
    }
  }

  RasterCamera CameraAt(const PosedCamera& view, int level) const {
    return MakeRasterCamera(view.camera.Scaled(SizeAtLevel(view.camera.width, level),
                                               SizeAtLevel(view.camera.height, level)),
                            view.cam_from_world);
  }

  ColorSpec Colors() const { return layout_.Spec(schedule_.ActiveDegree(fraction_)); }

  // Black; neutral in a' and b'.
  std::array<float, 3> Background() const {
    const float chroma = layout_.space == ColorSpace::kLab ? layout_.Base(1) : 0.0f;
    return {0.0f, chroma, chroma};
  }

  float UnitTime(const PosedCamera& view) const { return times_.UnitTime(view.time_s); }

  // All Gaussians at the view's time.
  const ParameterBlock& At(const PosedCamera& view, float hidden = 0.0f) {
    if (DeformsNow()) {
      return hexplanes_.At(state_.hexplane, state_.parameters, view.time_s, run_.pool);
    }
    if (state_.moving.parameters.count() == 0) return state_.parameters;
    ComposeAt(state_.parameters, state_.moving, UnitTime(view), run_.pool, composed_, hidden);
    return composed_;
  }

  int64_t Count() const { return state_.parameters.count() + state_.moving.parameters.count(); }

  bool IsAuto() const { return options_.motion == GeometryOptions::Motion::kAuto; }
  bool MayMove() const { return IsAuto() && times_.steps > 1 && state_.hexplane.empty(); }
  bool DeformsNow() const { return !state_.hexplane.empty() && hexplanes_.IsActive(fraction_); }

  void FindMovers() {
    if (!MayMove()) return;
    const auto target = [&](const PosedCamera& view, int level) {
      return targets_.Get(view, level);
    };
    const MoverSearchResult found =
        FindMovingPart(problem_, times_, state_.parameters, Colors(), target, options_, run_.pool);
    run_.progress.OnError(state_.iteration, "moving_share", found.moving_share);
    if (found.moving.parameters.count() == 0) return;
    state_.moving = found.moving;
    DensifyTarget still{state_.parameters, state_.moments, state_.statistics, state_.random};
    KeepMostOpaque(options_.max_gaussians - state_.moving.parameters.count(), still);
    state_.statistics.Reset(Count());
  }

  // Runs one iteration. Returns false if a value was not finite.
  bool Step() {
    const int drawn = state_.order.Next(static_cast<int>(problem_.training.size()), state_.random);
    const PosedCamera& view = problem_.training[drawn];
    const int level = schedule_.Level(fraction_, view.camera);
    const std::shared_ptr<const PlaneBuffer> target = targets_.Get(view, level);
    const RasterCamera camera = CameraAt(view, level);
    const ColorSpec color = Colors();
    const ParameterBlock& now = At(view, schedule_.HiddenTime(state_.iteration, times_.Interval()));
    pipeline_.Forward({now, color, camera}, Background().data(), false, run_.pool, DroppingNow());
    clock_.Enter(Phase::kLoss);
    const bool exposed = !state_.exposures.empty();
    if (exposed) Expose(state_.exposures[drawn], pipeline_.color(), run_.pool, exposed_);
    const PictureLossValue loss = loss_.Evaluate(exposed ? exposed_ : pipeline_.color(),
                                                 *target,
                                                 TrainingMask(view, level).get(),
                                                 run_.pool,
                                                 d_color_);
    if (!std::isfinite(loss.total)) return false;
    if (exposed) {
      FitExposure(pipeline_.color(),
                  schedule_.tuning().exposure_rate * (1.0 - fraction_),
                  schedule_.tuning().exposure_prior,
                  run_.pool,
                  d_color_,
                  state_.exposures[drawn]);
      Recenter(state_.exposures);
    }
    pipeline_.Backward({now, color, camera},
                       d_color_,
                       run_.pool,
                       {GradientScope::kAll, gradient_, &state_.statistics});
    if (!Update(view)) return false;
    state_.mean_error += (state_.mean_error == 0.0 ? 1.0 : 0.02) * (loss.l1 - state_.mean_error);
    return true;
  }

  // Null: all pixels count.
  std::shared_ptr<const PlaneBuffer> MaskOf(const PosedCamera& view, int level) {
    return problem_.mask ? masks_.Get(view, level) : nullptr;
  }

  // The training mask: until motion has been searched for, moving pixels are excluded.
  std::shared_ptr<const PlaneBuffer> TrainingMask(const PosedCamera& view, int level) {
    const std::shared_ptr<const PlaneBuffer> mask = MaskOf(view, level);
    if (!problem_.still || !MayMove() || fraction_ >= kSurveyAt) return mask;
    const std::shared_ptr<const PlaneBuffer> still = still_.Get(view, level);
    if (mask == nullptr || still == nullptr) return mask == nullptr ? still : mask;
    auto both = std::make_shared<PlaneBuffer>(*mask);
    for (size_t i = 0; i < both->data.size(); ++i) both->data[i] *= still->data[i];
    return both;
  }

  // Seeded by the iteration's number, so that a resumed training drops the same Gaussians.
  SplatDropping DroppingNow() const {
    return {schedule_.DropRate(fraction_, static_cast<int>(problem_.training.size())),
            options_.seed + (static_cast<uint64_t>(state_.iteration) << 20u)};
  }

  // Updates parameters from the gradient. Returns false if a value was not finite.
  bool Update(const PosedCamera& view) {
    clock_.Enter(Phase::kAdam);
    std::vector<float> rates = schedule_.LearningRates(fraction_, layout_);
    MovingPart& moving = state_.moving;
    bool finite =
        !DeformsNow() || hexplanes_.Update(state_.parameters,
                                           view.time_s,
                                           fraction_,
                                           options_.learning_rate_scale * state_.rate_scale,
                                           run_.pool,
                                           gradient_,
                                           state_.hexplane);
    if (moving.parameters.count() > 0) {
      DecomposeGradient(state_.parameters,
                        moving,
                        UnitTime(view),
                        composed_,
                        run_.pool,
                        gradient_,
                        moving_gradient_);
      finite = UpdatePart(moving_gradient_,
                          schedule_.MoverRates(fraction_, layout_, times_.Interval()),
                          moving.parameters,
                          moving.moments);
      LimitWindows(static_cast<float>(std::log(schedule_.tuning().least_width * times_.Interval())),
                   state_.parameters.rows(),
                   moving.parameters);
      if (finite) ShareMotionWhenDue();
    }
    const GeometryTuning& tuning = schedule_.tuning();
    if (tuning.opacity_penalty > 0.0 || tuning.scale_penalty > 0.0) {
      AddPenaltyGradients(state_.parameters,
                          static_cast<float>(tuning.opacity_penalty),
                          static_cast<float>(tuning.scale_penalty / problem_.extent),
                          run_.pool,
                          gradient_);
    }
    finite = UpdatePart(gradient_, std::move(rates), state_.parameters, state_.moments) && finite;
    clock_.Enter(Phase::kOther);
    return finite;
  }

  void ShareMotionWhenDue() {
    const GeometryTuning& tuning = schedule_.tuning();
    const int every = std::max(1, tuning.share_motion_every);
    if (!(tuning.share_motion > 0.0) || state_.iteration % every != 0) return;
    ShareMotion(
        {state_.parameters.rows(), times_.Interval(), tuning.motion_neighbors, tuning.share_motion},
        run_.pool,
        state_.moving.parameters);
  }

  bool UpdatePart(ParameterBlock& gradient,
                  std::vector<float> rates,
                  ParameterBlock& parameters,
                  AdamMoments& moments) {
    for (float& rate : rates) rate *= static_cast<float>(state_.rate_scale);
    const auto beta1 = static_cast<float>(schedule_.tuning().beta1);
    if (!AdamStep(gradient, rates, state_.iteration + 1, run_.pool, parameters, moments, beta1)) {
      return false;
    }
    const double ratio = schedule_.tuning().max_needle_ratio;
    if (ratio > 0.0) {
      LimitNeedles(static_cast<float>(std::log(ratio)), run_.pool, parameters);
    }
    return true;
  }

  // Maximum number of Gaussians after this round.
  int64_t CountAllowed() {
    const Moment now{clock_.TrainingSeconds(), state_.iteration};
    const double each =
        (now.seconds - last_round_.seconds) /
        static_cast<double>(std::max<int64_t>(1, now.iteration - last_round_.iteration));
    last_round_ = now;
    const int level = schedule_.Level(fraction_, problem_.training.front().camera);
    return schedule_.AffordableCount(fraction_, state_.iteration, each, level, Count());
  }

  void Densify(double before) {
    DensifyTarget target{state_.parameters, state_.moments, state_.statistics, state_.random};
    if (schedule_.DensifyDue(before, fraction_) &&
        state_.iteration - state_.densified_at >= kMinDensifyInterval) {
      state_.densified_at = state_.iteration;
      GradientDensifyOptions densify;
      densify.gradient_threshold = options_.densify_gradient;
      densify.clone_below_scale = 0.01 * problem_.extent;
      densify.max_gaussians = CountAllowed();
      const double prune_scale = schedule_.tuning().prune_scale;
      if (prune_scale > 0.0 && schedule_.HasReset(fraction_)) {
        densify.prune_scale = prune_scale * problem_.extent;
      }
      DensifyParts(densify, target, state_.moving);
    }
    if (schedule_.OpacityResetDue(before, fraction_)) ResetOpacity(0.01, target);
  }

  bool InLab() const { return layout_.channels == 3 && layout_.space == ColorSpace::kLab; }

  std::string Named(const char* what, const char* unit = "") const {
    return std::string(what) + (InLab() ? "_ab" : layout_.channels == 3 ? "_rgb" : "_l") + unit;
  }

  void Report(double before) {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_progress_ > std::chrono::milliseconds(250) || fraction_ >= end_) {
      last_progress_ = now;
      const Camera& camera = problem_.training.front().camera;
      const int level = schedule_.Level(fraction_, camera);
      run_.progress.OnProgress(
          state_.iteration,
          std::llround(end_ * static_cast<double>(state_.iteration) / std::max(fraction_, 1e-9)),
          fmt::format("geometry, {} Gaussians at {}x{} px",
                      Count(),
                      SizeAtLevel(camera.width, level),
                      SizeAtLevel(camera.height, level)));
    }
    if (std::floor(fraction_ * kErrorReports) > std::floor(before * kErrorReports)) {
      run_.progress.OnError(state_.iteration,
                            Named("train_l1"),
                            InLab() ? kAbUnits * state_.mean_error : state_.mean_error);
    }
    for (const double moment : kHeldOutMoments) {
      if (before < moment && fraction_ >= moment) {
        ReportHeldOut();
        break;
      }
    }
  }

  // Means over the held-out views; not counted as training time.
  void ReportHeldOut() {
    if (problem_.held_out.empty()) return;
    const HeldOutPoint point = Score(problem_.held_out);
    run_.progress.OnError(state_.iteration, Named("heldout_psnr", "_db"), point.psnr_db);
    if (trace_ != nullptr) trace_->held_out.push_back(point);
  }

  HeldOutPoint Score(const std::vector<PosedCamera>& views) {
    HeldOutPoint point;
    point.seconds = earlier_seconds_ + clock_.TrainingSeconds();
    point.iteration = state_.iteration;
    point.gaussians = Count();
    pipeline_.set_clock(nullptr);
    clock_.Enter(Phase::kEvaluation);
    const double each = 1.0 / static_cast<double>(views.size());
    for (const PosedCamera& view : views) {
      const std::shared_ptr<const PlaneBuffer> target = targets_.Get(view, 0);
      pipeline_.Forward(
          {At(view), Colors(), CameraAt(view, 0)}, Background().data(), false, run_.pool);
      PlaneBuffer drawn = pipeline_.color();
      const PictureQuality quality =
          CompareClamped(*target, MaskOf(view, 0).get(), loss_.image_loss(), run_.pool, drawn);
      point.psnr_db += each * quality.psnr_db;
      point.ssim += each * quality.ssim;
      point.l1 += each * quality.l1;
      if (fraction_ >= end_ && trace_ != nullptr && trace_->on_picture) {
        trace_->on_picture(view.view, ImageFromPlanes(drawn));
      }
    }
    clock_.Enter(Phase::kOther);
    pipeline_.set_clock(&clock_);
    return point;
  }

  void FinishTrace() {
    if (trace_ == nullptr) return;
    trace_->seconds = clock_.TrainingSeconds();
    trace_->phases = clock_.seconds();
    trace_->iterations = state_.iteration;
    trace_->gaussians = Count();
    if (trace_->score_training) trace_->training = Score(problem_.training);
  }

  struct Moment {
    double seconds = 0.0;  // on the clock
    int64_t iteration = 0;
  };

  const GeometryProblem& problem_;
  const GeometryOptions& options_;
  const RunControl& run_;
  TrainingTrace* const trace_;  // may be null
  const TrainingSchedule schedule_;
  const TimeSpan times_;
  const ColorLayout layout_;
  const double end_;  // fraction of the schedule
  TrainingTargets targets_;
  TrainingTargets masks_;
  TrainingTargets still_;
  HexPlaneTraining hexplanes_;
  GeometryState state_;
  int64_t initial_count_ = 0;     // Gaussians
  double fraction_ = 0.0;         // completed fraction of the schedule
  double earlier_seconds_ = 0.0;  // of training, in the attempts before this one
  PhaseClock clock_;              // of this attempt
  Moment last_round_;             // of densification
  std::chrono::steady_clock::time_point last_progress_;
  // Work space.
  SplatPipeline pipeline_;
  PictureLoss loss_;
  PlaneBuffer exposed_;
  PlaneBuffer d_color_;
  ParameterBlock composed_;
  ParameterBlock gradient_;
  ParameterBlock moving_gradient_;
};

}  // namespace

GaussianModel TrainGeometry(const GeometryProblem& problem,
                            const GeometryOptions& options,
                            const RunControl& run,
                            TrainingTrace* trace,
                            GeometryState* state) {
  options.Validate();
  if (problem.training.empty()) {
    throw InvalidArgument("the scene has no training views; give at least one posed photo");
  }
  GeometryTrainer trainer(problem, options, run, trace);
  GaussianModel model = trainer.Train();
  if (state != nullptr) *state = trainer.TakeState();
  return model;
}

}  // namespace color3d
