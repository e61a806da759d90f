#include "core/splat/chroma_fit.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/splat/loss.h"
#include "core/splat/model_parameters.h"
#include "core/splat/neighbors.h"
#include "core/splat/pipeline.h"
#include "core/splat/spherical_harmonics.h"
#include "core/splat/training_guard.h"
#include "core/splat/training_state.h"
#include "core/splat/training_targets.h"

namespace color3d {
namespace {

constexpr float kShDc = 0.28209479177387814f;
constexpr double kDcRate = 2.5e-3;  // as 3DGS; a' and b' have range 1
constexpr double kRestDivisor = 20.0;
constexpr double kLastRate = 0.1;  // of the first, at the end (log-linear)
// Blending weight, summed over all training pixels, below which a Gaussian counts as unseen.
constexpr double kMinSeenWeight = 0.05;
constexpr int kFillNeighbors = 4;
constexpr int kErrorReports = 50;

struct Target {
  PlaneBuffer ab;      // a', b'
  PlaneBuffer weight;  // 1 channel
};

void CheckTarget(const ChromaTarget& target, const PosedCamera& view) {
  const auto fits = [&](const Image& image, int channels) {
    return image.channels == channels && image.width == view.camera.width &&
           image.height == view.camera.height;
  };
  if (fits(target.ab, 2) && (target.weight.Empty() || fits(target.weight, 1))) return;
  throw InvalidArgument(
      "chroma target of view " + std::to_string(view.view) + " is " +
      std::to_string(target.ab.width) + "x" + std::to_string(target.ab.height) + "x" +
      std::to_string(target.ab.channels) + "; " + std::to_string(view.camera.width) + "x" +
      std::to_string(view.camera.height) + "x2 is needed, and the same size for the weight");
}

class ChromaTrainer {
 public:
  ChromaTrainer(const GaussianModel& geometry,
                const ChromaProblem& problem,
                const ChromaOptions& options,
                ThreadPool& pool,
                ProgressObserver& progress)
      : problem_(problem), options_(options), pool_(pool), progress_(progress) {
    // Luminance rows are not needed; both chroma channels stand at its place.
    const ParameterBlock from = ParametersFromModel(geometry);
    const int chroma = ShCoefficients(options.chroma_sh_degree);
    state_.parameters = ParameterBlock(kColorRow + 2 * chroma, from.count());
    for (int r = 0; r < kColorRow; ++r) {
      std::copy_n(from.Row(r), from.count(), state_.parameters.Row(r));
    }
    state_.moments = {ParameterBlock(state_.parameters.rows(), from.count()),
                      ParameterBlock(state_.parameters.rows(), from.count())};
    state_.random = Random(options.seed, 1);
    color_.channels = 2;
    color_.channel[0] = {kColorRow, chroma, kNeutralChroma, false};
    color_.channel[1] = {kColorRow + chroma, chroma, kNeutralChroma, false};
  }

  void Fit(CheckpointStore& checkpoints, const CancellationToken& cancel) {
    TrainingGuard guard(progress_);
    SolveDc(cancel);
    Resume(checkpoints);
    guard.Keep(state_);
    while (state_.iteration < options_.iterations && !usable_.empty()) {
      cancel.ThrowIfCancelled();
      if (!Step()) {
        guard.Restore("chroma", state_);
        continue;
      }
      ++state_.iteration;
      if (guard.IsDue(state_.iteration)) guard.Keep(state_);
      Report();
      if (checkpoints.WantsSave()) {
        checkpoints.Save(SerializeTrainingState(state_, Fingerprint()));
      }
    }
    FillUnseen();
  }

  GaussianModel Result(const GaussianModel& geometry) const {
    GaussianModel model = geometry;
    const int chroma = ShCoefficients(options_.chroma_sh_degree);
    model.channels = 3;
    model.chroma_sh_degree = options_.chroma_sh_degree;
    model.sh_a.resize(model.size() * chroma);
    model.sh_b.resize(model.size() * chroma);
    for (size_t i = 0; i < model.size(); ++i) {
      for (int k = 0; k < chroma; ++k) {
        model.sh_a[i * chroma + k] = state_.parameters.Row(kColorRow + k)[i];
        model.sh_b[i * chroma + k] = state_.parameters.Row(kColorRow + chroma + k)[i];
      }
    }
    return model;
  }

 private:
  std::string Fingerprint() const {
    char text[128];
    std::snprintf(text,
                  sizeof(text),
                  "chroma %d %d %g %llu %zu %lld",
                  options_.iterations,
                  options_.chroma_sh_degree,
                  options_.ssim_weight,
                  static_cast<unsigned long long>(options_.seed),
                  problem_.training.size(),
                  static_cast<long long>(state_.parameters.count()));
    return text;
  }

  void Resume(CheckpointStore& checkpoints) {
    const std::optional<std::string> saved = checkpoints.Load();
    if (saved && !ParseTrainingState(*saved, Fingerprint(), state_)) {
      progress_.OnWarning(
          "chroma: the checkpoint belongs to other options or is damaged; fitting starts afresh");
    }
  }

  // False when the view has no colours.
  bool Load(const PosedCamera& view, Target* target) const {
    const std::shared_ptr<const ChromaTarget> given = problem_.targets(view.view);
    if (given == nullptr) return false;
    CheckTarget(*given, view);
    target->ab = PlanesFromImage(given->ab, 128.0f, 1.0f / 255.0f);
    if (given->weight.Empty()) {
      target->weight =
          PlanesFromImage(Image(given->ab.width, given->ab.height, 1, 1.0f), 0.0f, 1.0f);
    } else {
      target->weight = PlanesFromImage(given->weight, 0.0f, 1.0f);
    }
    return true;
  }

  // Visibility-weighted mean of the targets: sum(w alpha T c) / sum(w alpha T) for each Gaussian,
  // by the adjoint of the renderer with (w a', w b', w) as "gradient" (the diagonal approximation
  // of the normal equations).
  void SolveDc(const CancellationToken& cancel) {
    const int64_t n = state_.parameters.count();
    ParameterBlock probe = state_.parameters;
    if (probe.rows() < kColorRow + 3) probe = WithRows(probe, kColorRow + 3);
    ColorSpec dc;
    dc.channels = 3;
    for (int c = 0; c < 3; ++c) dc.channel[c] = {kColorRow + c, 1, 0.0f, false};
    const float background[3] = {0.0f, 0.0f, 0.0f};
    std::vector<double> sums[3];
    for (auto& s : sums) s.assign(n, 0.0);
    PlaneBuffer adjoint;
    ParameterBlock gradient;
    for (size_t k = 0; k < problem_.training.size(); ++k) {
      cancel.ThrowIfCancelled();
      const PosedCamera& view = problem_.training[k];
      Target target;
      if (!Load(view, &target)) continue;
      usable_.push_back(static_cast<int>(k));
      const RasterCamera camera = MakeRasterCamera(view.camera, view.cam_from_world);
      adjoint.Reset(camera.width, camera.height, 3);
      for (int y = 0; y < camera.height; ++y) {
        const float* w = target.weight.Row(0, y);
        for (int x = 0; x < camera.width; ++x) {
          adjoint.Row(0, y)[x] = w[x] * target.ab.Row(0, y)[x];
          adjoint.Row(1, y)[x] = w[x] * target.ab.Row(1, y)[x];
          adjoint.Row(2, y)[x] = w[x];
        }
      }
      pipeline_.Forward(probe, dc, camera, background, false, pool_);
      pipeline_.Backward(probe, dc, camera, adjoint, GradientScope::kColorOnly, pool_, gradient);
      for (int c = 0; c < 3; ++c) {
        const float* g = gradient.Row(kColorRow + c);
        for (int64_t i = 0; i < n; ++i) sums[c][i] += g[i] / kShDc;
      }
    }
    SetDc(sums);
  }

  void SetDc(const std::vector<double> (&sums)[3]) {
    const int64_t n = state_.parameters.count();
    seen_.assign(n, 0);
    for (int64_t i = 0; i < n; ++i) {
      const double a = sums[0][i] / sums[2][i], b = sums[1][i] / sums[2][i];
      if (!(sums[2][i] >= kMinSeenWeight) || !std::isfinite(a) || !std::isfinite(b)) continue;
      seen_[i] = 1;
      state_.parameters.Row(color_.channel[0].row)[i] =
          static_cast<float>((a - kNeutralChroma) / kShDc);
      state_.parameters.Row(color_.channel[1].row)[i] =
          static_cast<float>((b - kNeutralChroma) / kShDc);
    }
    FillUnseen();
  }

  static ParameterBlock WithRows(const ParameterBlock& from, int rows) {
    ParameterBlock to(rows, from.count());
    for (int r = 0; r < from.rows(); ++r) std::copy_n(from.Row(r), from.count(), to.Row(r));
    return to;
  }

  NeighborTree::Point PositionOf(int64_t i) const {
    const ParameterBlock& p = state_.parameters;
    return {p.Row(kPositionRow)[i], p.Row(kPositionRow + 1)[i], p.Row(kPositionRow + 2)[i]};
  }

  // Gaussians that no target pixel sees take the mean of their nearest seen neighbours, nearer ones
  // counting more. With no neighbour at all they stay neutral.
  void FillUnseen() {
    ParameterBlock& p = state_.parameters;
    std::vector<NeighborTree::Point> points;
    std::vector<int64_t> index_of;
    for (int64_t i = 0; i < p.count(); ++i) {
      if (!seen_[i]) continue;
      points.push_back(PositionOf(i));
      index_of.push_back(i);
    }
    if (points.empty() || static_cast<int64_t>(points.size()) == p.count()) return;
    const NeighborTree tree(std::move(points));
    pool_.ForRanges(p.count(), [&](int64_t begin, int64_t end, int) {
      std::vector<NeighborTree::Neighbor> near;
      for (int64_t i = begin; i < end; ++i) {
        if (seen_[i]) continue;
        tree.Find(PositionOf(i), kFillNeighbors, near);
        double total = 0.0, a = 0.0, b = 0.0;
        for (const NeighborTree::Neighbor& neighbor : near) {
          const double weight = 1.0 / (1e-12 + neighbor.squared_distance);
          const int64_t j = index_of[neighbor.index];
          total += weight;
          a += weight * p.Row(color_.channel[0].row)[j];
          b += weight * p.Row(color_.channel[1].row)[j];
        }
        if (!(total > 0.0) || !std::isfinite(a / total) || !std::isfinite(b / total)) continue;
        p.Row(color_.channel[0].row)[i] = static_cast<float>(a / total);
        p.Row(color_.channel[1].row)[i] = static_cast<float>(b / total);
      }
    });
  }

  std::vector<float> LearningRates() const {
    std::vector<float> rates(state_.parameters.rows(), 0.0f);
    const double done = static_cast<double>(state_.iteration) / std::max(1, options_.iterations);
    const double rate = kDcRate * std::pow(kLastRate, done) * state_.rate_scale;
    for (int c = 0; c < 2; ++c) {
      for (int k = 0; k < color_.channel[c].coefficients; ++k) {
        rates[color_.channel[c].row + k] = static_cast<float>(k == 0 ? rate : rate / kRestDivisor);
      }
    }
    return rates;
  }

  bool Step() {
    const PosedCamera& view =
        problem_.training[usable_[state_.NextView(static_cast<int>(usable_.size()))]];
    Target target;
    if (!Load(view, &target)) return true;
    const RasterCamera camera = MakeRasterCamera(view.camera, view.cam_from_world);
    const float background[2] = {kNeutralChroma, kNeutralChroma};
    pipeline_.Forward(state_.parameters, color_, camera, background, false, pool_);
    LossWeights weights;
    weights.ssim = static_cast<float>(options_.ssim_weight);
    weights.l1 = 1.0f - weights.ssim;
    weights.edge = 0.0f;
    const LossValue loss =
        loss_.Evaluate(pipeline_.color(), target.ab, &target.weight, weights, pool_, d_color_);
    if (!std::isfinite(loss.total)) return false;
    pipeline_.Backward(
        state_.parameters, color_, camera, d_color_, GradientScope::kColorOnly, pool_, gradient_);
    if (!AdamStep(gradient_,
                  LearningRates(),
                  state_.iteration + 1,
                  pool_,
                  state_.parameters,
                  state_.moments)) {
      return false;
    }
    state_.mean_error += (state_.mean_error == 0.0 ? 1.0 : 0.02) * (loss.l1 - state_.mean_error);
    return true;
  }

  void Report() {
    const int64_t n = options_.iterations;
    const auto now = std::chrono::steady_clock::now();
    if (now - last_progress_ > std::chrono::milliseconds(250) || state_.iteration == n) {
      last_progress_ = now;
      progress_.OnProgress(state_.iteration,
                           n,
                           "chroma on " + std::to_string(state_.parameters.count()) + " Gaussians");
    }
    if (state_.iteration % std::max<int64_t>(1, n / kErrorReports) == 0 || state_.iteration == n) {
      progress_.OnError(state_.iteration, "train_l1_ab", 255.0 * state_.mean_error);
    }
  }

  const ChromaProblem& problem_;
  const ChromaOptions& options_;
  ThreadPool& pool_;
  ProgressObserver& progress_;
  ColorSpec color_;
  TrainingState state_;
  std::vector<char> seen_;
  std::vector<int> usable_;  // positions in problem_.training that have colours
  SplatPipeline pipeline_;
  ImageLoss loss_;
  PlaneBuffer d_color_;
  ParameterBlock gradient_;
  std::chrono::steady_clock::time_point last_progress_;
};

}  // namespace

GaussianModel FitChromaOn(const GaussianModel& geometry,
                          const ChromaProblem& problem,
                          const ChromaOptions& options,
                          ThreadPool& pool,
                          CheckpointStore& checkpoints,
                          ProgressObserver& progress,
                          const CancellationToken& cancel) {
  options.Validate();
  if (problem.training.empty()) {
    throw InvalidArgument("the scene has no training views; give at least one posed photo");
  }
  ChromaTrainer trainer(geometry, problem, options, pool, progress);
  trainer.Fit(checkpoints, cancel);
  return trainer.Result(geometry);
}

}  // namespace color3d
