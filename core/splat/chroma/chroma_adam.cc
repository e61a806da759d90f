#include "core/splat/chroma/chroma_adam.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/color/lab.h"
#include "core/splat/chroma/chroma_targets.h"
#include "core/splat/motion/geometry_in_time.h"
#include "core/splat/raster/pipeline.h"
#include "core/splat/raster/raster_camera.h"
#include "core/splat/training/loss.h"
#include "core/splat/training/training_guard.h"
#include "core/splat/training/training_state.h"

namespace color3d {
namespace {

constexpr double kDcRate = 2.5e-3;  // as 3DGS; a' and b' have range 1
constexpr double kRestDivisor = 20.0;
constexpr double kLastRate = 0.1;  // of the first, at the end (log-linear)
constexpr int kErrorReports = 50;

class ChromaTrainer {
 public:
  ChromaTrainer(const ChromaFitting& fitting,
                const std::vector<int>& colored,
                ChromaTargets& targets,
                ChromaParameters& parameters)
      : fitting_(fitting),
        options_(fitting.options),
        run_(fitting.run),
        colored_(colored),
        targets_(targets),
        parameters_(parameters),
        in_time_(fitting.geometry, fitting.run.pool) {
    state_.parameters = parameters.block;
    const ParameterBlock zeros = state_.parameters.ZerosOfSameShape();
    state_.moments = {zeros, zeros};
    state_.random = Random(options_.seed, 1);
  }

  void Train() {
    TrainingGuard<TrainingState> guard("chroma", run_.progress);
    Resume();
    const double earlier = state_.elapsed_seconds;
    guard.Keep(state_);
    while (state_.iteration < options_.iterations &&
           !fitting_.IsOutOfTime(state_.elapsed_seconds)) {
      run_.cancel.ThrowIfCancelled();
      if (!Step()) {
        guard.Restore(state_);
        continue;
      }
      ++state_.iteration;
      state_.elapsed_seconds = earlier + fitting_.clock.Seconds();
      if (guard.IsDue(state_.iteration)) guard.Keep(state_);
      Report();
      if (run_.checkpoints.WantsSave()) {
        CheckpointWriter writer(Fingerprint());
        VisitState(writer, state_);
        run_.checkpoints.Save(std::move(writer).Finish());
      }
    }
    parameters_.block = state_.parameters;
  }

 private:
  // All inputs of the fit except the targets.
  std::string Fingerprint() const {
    return fmt::format("chroma adam {} {} {} {} {} {} {}",
                       options_.iterations,
                       options_.chroma_sh_degree,
                       options_.time_limit_seconds,
                       options_.ssim_weight,
                       options_.seed,
                       fitting_.problem.training.size(),
                       state_.parameters.count());
  }

  void Resume() {
    const std::optional<std::string> saved = run_.checkpoints.Load();
    if (!saved) return;
    CheckpointReader reader(*saved, Fingerprint());
    TrainingState read;
    if (reader.ok()) VisitState(reader, read);
    if (reader.ok()) {
      state_ = std::move(read);
    } else {
      run_.progress.OnWarning(
          "chroma: the checkpoint belongs to other options or is damaged; fitting starts afresh");
    }
  }

  // Completed share of the schedule, by iterations or by time.
  double Done() const {
    const double by_count =
        static_cast<double>(state_.iteration) / std::max(1, options_.iterations);
    const double limit = options_.time_limit_seconds;
    return limit > 0.0 ? std::min(1.0, std::max(by_count, state_.elapsed_seconds / limit))
                       : by_count;
  }

  std::vector<float> LearningRates() const {
    std::vector<float> rates(state_.parameters.rows(), 0.0f);
    const double rate = kDcRate * std::pow(kLastRate, Done()) * state_.rate_scale;
    for (const ColorChannel& channel :
         {parameters_.color.channel[0], parameters_.color.channel[1]}) {
      for (int k = 0; k < channel.coefficients; ++k) {
        rates[channel.row + k] = static_cast<float>(k == 0 ? rate : rate / kRestDivisor);
      }
    }
    return rates;
  }

  bool Step() {
    const PosedCamera& view = fitting_.problem.training[static_cast<size_t>(
        colored_[state_.order.Next(static_cast<int>(colored_.size()), state_.random)])];
    const std::shared_ptr<const ChromaPlanes> target = targets_.Get(view);
    if (target == nullptr) return true;
    target_ab_ = target->ab;
    for (float& value : target_ab_.data) value += kNeutralChroma;
    const RasterCamera camera = MakeRasterCamera(view.camera, view.cam_from_world);
    const float background[2] = {kNeutralChroma, kNeutralChroma};
    const ColorSpec& color = parameters_.color;
    ThreadPool& pool = run_.pool;
    const ParameterBlock& now = in_time_.At(state_.parameters, view.time_s);
    pipeline_.Forward({now, color, camera}, background, false, pool);
    LossWeights weights;
    weights.ssim = static_cast<float>(options_.ssim_weight);
    weights.l1 = 1.0f - weights.ssim;
    weights.edge = 0.0f;
    const LossValue loss =
        loss_.Evaluate(pipeline_.color(), target_ab_, &target->weight, weights, pool, d_color_);
    if (!std::isfinite(loss.total)) return false;
    pipeline_.Backward(
        {now, color, camera}, d_color_, pool, {GradientScope::kColorOnly, gradient_});
    if (!AdamStep(gradient_,
                  LearningRates(),
                  state_.iteration + 1,
                  pool,
                  state_.parameters,
                  state_.moments)) {
      return false;
    }
    state_.mean_error += (state_.mean_error == 0.0 ? 1.0 : 0.02) * (loss.l1 - state_.mean_error);
    return true;
  }

  void Report() {
    const int64_t n = options_.iterations;
    const double now = fitting_.clock.Seconds();
    if (now - last_progress_ > 0.25 || state_.iteration == n) {
      last_progress_ = now;
      run_.progress.OnProgress(
          state_.iteration, n, fmt::format("chroma on {} Gaussians", state_.parameters.count()));
    }
    if (state_.iteration % std::max<int64_t>(1, n / kErrorReports) == 0 || state_.iteration == n) {
      run_.progress.OnError(state_.iteration, "train_l1_ab", 255.0 * state_.mean_error);
    }
    if (fitting_.problem.snapshot &&
        (state_.iteration >= next_snapshot_ || state_.iteration == n)) {
      next_snapshot_ = state_.iteration * 3 / 2 + 5;
      parameters_.block = state_.parameters;
      fitting_.Snapshot(state_.iteration, parameters_);
    }
  }

  const ChromaFitting& fitting_;
  const ChromaOptions& options_;
  const RunControl& run_;
  const std::vector<int>& colored_;
  ChromaTargets& targets_;
  ChromaParameters& parameters_;
  GeometryInTime in_time_;
  TrainingState state_;
  SplatPipeline pipeline_;
  ImageLoss loss_;
  PlaneBuffer target_ab_;
  PlaneBuffer d_color_;
  ParameterBlock gradient_;
  double last_progress_ = 0.0;
  int64_t next_snapshot_ = 10;
};

}  // namespace

void TrainChromaWithAdam(const ChromaFitting& fitting,
                         const std::vector<int>& colored,
                         ChromaTargets& targets,
                         ChromaParameters& parameters) {
  ChromaTrainer(fitting, colored, targets, parameters).Train();
}

}  // namespace color3d
