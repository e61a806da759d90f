#include "core/splat/chroma/chroma_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/training/checkpoint.h"

namespace color3d {
namespace {

// First step of the ordered-subsets sweeps, and its factor from sweep to sweep. Measured.
constexpr double kFirstRelaxation = 1.0;
constexpr double kRelaxationDecay = 0.9;

constexpr double kMaxChroma = 128.0 / 255.0;

class ChromaSolver {
 public:
  ChromaSolver(const ChromaFitting& fitting,
               const std::vector<char>& seen,
               ChromaSystem& system,
               ChromaParameters& parameters)
      : fitting_(fitting),
        options_(fitting.options),
        run_(fitting.run),
        seen_(seen),
        system_(system),
        parameters_(parameters) {
    x_ = FromParameters();
    first_ = x_;
  }

  void Solve() {
    Resume();
    while (state_.sweep < options_.sweeps && !Ended()) {
      const double relaxation =
          kFirstRelaxation * std::pow(kRelaxationDecay, static_cast<double>(state_.sweep));
      const double l1 =
          system_.Sweep(Robust(), relaxation, 1.0 / options_.tikhonov_rest, seen_, run_.cancel, x_);
      ReportL1(l1);
      ++state_.sweep;
      ++state_.iteration;
      EndRound();
    }
    while (state_.round < options_.rounds && !Ended()) {
      system_.Reweight(x_, Robust(), run_.cancel, residuals_);
      ReportL1(residuals_.mean_l1);
      const double before = state_.last_l1;
      state_.last_l1 = residuals_.mean_l1;
      if (state_.round > 0 && before - residuals_.mean_l1 < options_.objective_tolerance * before) {
        break;
      }
      InvertBlocks();
      Iterate();
      ++state_.round;
      EndRound();
    }
  }

 private:
  // Progress of the solver: with the coefficients, its complete state between rounds.
  struct State {
    int32_t sweep = 0;      // sweeps that are done
    int32_t round = 0;      // rounds of reweighting that are done
    int64_t iteration = 0;  // passes over all views
    double last_l1 = 0.0;   // of the previous round
  };
  static_assert(sizeof(State) == 24, "no padding in checkpoints");
  using Pair = std::array<double, 2>;  // of a', b'

  double Seconds() const { return earlier_seconds_ + fitting_.clock.Seconds(); }
  bool IsOutOfTime() const { return fitting_.IsOutOfTime(Seconds()); }
  bool Ended() const { return state_.iteration >= options_.iterations || IsOutOfTime(); }

  ChromaVector FromParameters() const {
    const int n = parameters_.coefficients();
    ChromaVector x(static_cast<size_t>(system_.count()) * n * 2);
    for (int64_t i = 0; i < system_.count(); ++i) {
      for (int k = 0; k < n; ++k) {
        for (int c = 0; c < 2; ++c) x[(i * n + k) * 2 + c] = parameters_.Row(c, k)[i];
      }
    }
    return x;
  }

  // Rounded to float, so that resuming from a checkpoint gives the same bytes. Splats that occlude
  // each other can cancel with impossible chroma, so values are limited to the range of Lab.
  void ToParameters() {
    const int n = parameters_.coefficients();
    for (int64_t i = 0; i < system_.count(); ++i) {
      for (int k = 0; k < n; ++k) {
        for (int c = 0; c < 2; ++c) {
          double& value = x_[(i * n + k) * 2 + c];
          if (k == 0) value = std::clamp(value, -kMaxChroma / kShDc, kMaxChroma / kShDc);
          parameters_.Row(c, k)[i] = static_cast<float>(value);
          value = parameters_.Row(c, k)[i];
        }
      }
    }
  }

  RobustWeights Robust() const {
    RobustWeights robust;
    robust.on = options_.robust;
    return robust;
  }

  void ReportL1(double mean_l1) {
    run_.progress.OnError(state_.iteration, "train_l1_ab", 255.0 * mean_l1);
    run_.progress.OnProgress(state_.iteration,
                             options_.iterations,
                             fmt::format("chroma on {} Gaussians", system_.count()));
  }

  void EndRound() {
    ToParameters();
    fitting_.Snapshot(state_.iteration, parameters_);
    Save();
  }

  double Pull(int k) const {
    return options_.tikhonov * kShDc * kShDc * (k == 0 ? 1.0 : options_.tikhonov_rest);
  }

  // Inverse of the regularised diagonal blocks: block Jacobi.
  void InvertBlocks() {
    const int n = parameters_.coefficients();
    run_.pool.ForRanges(2 * system_.count(), [&](int64_t begin, int64_t end, int) {
      for (int64_t i = begin; i < end; ++i) {
        using Block =
            Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, 16, 16>;
        Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> block(
            residuals_.blocks.data() + i * n * n, n, n);
        Block m = block;
        for (int k = 0; k < n; ++k) m(k, k) += Pull(k);
        const Eigen::LLT<Block> factor(m);
        if (seen_[i / 2] != 0 && factor.info() == Eigen::Success && m.allFinite()) {
          block = factor.solve(Block::Identity(n, n));
        } else {
          block.setZero();  // stays where it is
        }
      }
    });
  }

  // z = M^-1 r, and r . z of each channel.
  Pair Precondition(const ChromaVector& r, ChromaVector& z) const {
    const int n = parameters_.coefficients();
    Pair dot = {0.0, 0.0};
    for (int64_t i = 0; i < system_.count(); ++i) {
      for (int c = 0; c < 2; ++c) {
        const double* inverse = residuals_.blocks.data() + (i * 2 + c) * n * n;
        for (int k = 0; k < n; ++k) {
          double sum = 0.0;
          for (int l = 0; l < n; ++l) sum += inverse[k * n + l] * r[(i * n + l) * 2 + c];
          z[(i * n + k) * 2 + c] = sum;
          dot[c] += sum * r[(i * n + k) * 2 + c];
        }
      }
    }
    return dot;
  }

  // Preconditioned conjugate gradients (Hestenes & Stiefel 1952), a' and b' side by side with
  // scalars of their own.
  void Iterate() {
    const size_t size = x_.size();
    const int n = parameters_.coefficients();
    ChromaVector r = residuals_.gradient, z(size), p, q;
    for (size_t j = 0; j < size; ++j) {
      r[j] -= Pull(static_cast<int>(j / 2 % n)) * (x_[j] - first_[j]);
    }
    const Pair right = Precondition(residuals_.right, z);
    Pair rho = Precondition(r, z);
    const Pair start = rho;
    if (right[0] + right[1] > 0.0) {
      run_.progress.OnError(state_.iteration,
                            "chroma_residual",
                            std::sqrt((rho[0] + rho[1]) / (right[0] + right[1])));
    }
    p = z;
    const double stop = options_.residual_tolerance * options_.residual_tolerance;
    for (int step = 0; step < options_.steps_per_round && !Ended(); ++step) {
      if (!(rho[0] > stop * start[0]) && !(rho[1] > stop * start[1])) break;
      system_.Multiply(p, run_.cancel, q);
      Pair curvature = {0.0, 0.0}, alpha, beta;
      for (size_t j = 0; j < size; ++j) {
        q[j] += Pull(static_cast<int>(j / 2 % n)) * p[j];
        curvature[j % 2] += p[j] * q[j];
      }
      for (int c = 0; c < 2; ++c) {
        alpha[c] = rho[c] > 0.0 && curvature[c] > 0.0 ? rho[c] / curvature[c] : 0.0;
      }
      for (size_t j = 0; j < size; ++j) {
        x_[j] += alpha[j % 2] * p[j];
        r[j] -= alpha[j % 2] * q[j];
      }
      const Pair next = Precondition(r, z);
      for (int c = 0; c < 2; ++c) beta[c] = rho[c] > 0.0 ? next[c] / rho[c] : 0.0;
      for (size_t j = 0; j < size; ++j) p[j] = z[j] + beta[j % 2] * p[j];
      rho = next;
      ++state_.iteration;
    }
  }

  // All inputs of the fit except the targets.
  std::string Fingerprint() const {
    return fmt::format("chroma cg {} {} {} {} {} {} {} {} {} {} {} {}",
                       options_.iterations,
                       options_.chroma_sh_degree,
                       options_.residual_tolerance,
                       options_.objective_tolerance,
                       options_.tikhonov,
                       options_.tikhonov_rest,
                       options_.robust,
                       options_.sweeps,
                       options_.rounds,
                       options_.steps_per_round,
                       fitting_.problem.training.size(),
                       system_.count());
  }

  // Between rounds only.
  void Save() {
    if (!run_.checkpoints.WantsSave()) return;
    CheckpointWriter writer(Fingerprint());
    writer.Block(parameters_.block);
    writer.Value(state_);
    writer.Value(Seconds());
    run_.checkpoints.Save(std::move(writer).Finish());
  }

  void Resume() {
    const std::optional<std::string> saved = run_.checkpoints.Load();
    if (!saved) return;
    CheckpointReader reader(*saved, Fingerprint());
    ParameterBlock block;
    State state;
    double seconds = 0.0;
    reader.Block(block);
    reader.Value(state);
    reader.Value(seconds);
    if (!reader.ok() || !block.HasShapeOf(parameters_.block)) {
      run_.progress.OnWarning(
          "chroma: the checkpoint belongs to other options or is damaged; fitting starts afresh");
      return;
    }
    parameters_.block = std::move(block);
    state_ = state;
    earlier_seconds_ = seconds;
    x_ = FromParameters();
  }

  const ChromaFitting& fitting_;
  const ChromaOptions& options_;
  const RunControl& run_;
  const std::vector<char>& seen_;
  ChromaSystem& system_;
  ChromaParameters& parameters_;
  State state_;
  double earlier_seconds_ = 0.0;  // in the attempts before this one
  ChromaVector x_, first_;        // coefficients now, and of the closed form
  ChromaSystem::Residuals residuals_;
};

}  // namespace

void SolveChroma(const ChromaFitting& fitting,
                 const std::vector<char>& seen,
                 ChromaSystem& system,
                 ChromaParameters& parameters) {
  ChromaSolver(fitting, seen, system, parameters).Solve();
}

}  // namespace color3d
