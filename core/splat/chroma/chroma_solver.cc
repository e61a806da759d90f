#include "core/splat/chroma/chroma_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "core/splat/training/training_state.h"

namespace color3d {
namespace {

// Of the ordered-subsets sweeps: the first step, and the factor from sweep to sweep. Measured.
constexpr double kFirstRelaxation = 1.0;
constexpr double kRelaxationDecay = 0.9;

constexpr double kMaxChroma = 128.0 / 255.0;

class ChromaSolver {
 public:
  ChromaSolver(const ChromaRun& run,
               const std::vector<char>& seen,
               ChromaSystem& system,
               ChromaParameters& parameters)
      : run_(run), seen_(seen), system_(system), parameters_(parameters) {
    x_ = FromParameters();
    first_ = x_;
  }

  void Solve() {
    Resume();
    while (position_.sweep < run_.options.sweeps && !Ended()) {
      const double relaxation =
          kFirstRelaxation * std::pow(kRelaxationDecay, static_cast<double>(position_.sweep));
      const double l1 = system_.Sweep(
          Robust(), relaxation, 1.0 / run_.options.tikhonov_rest, seen_, run_.cancel, x_);
      ReportL1(l1);
      ++position_.sweep;
      ++position_.iteration;
      EndRound();
    }
    while (position_.round < run_.options.rounds && !Ended()) {
      system_.Reweight(x_, Robust(), run_.cancel, residuals_);
      ReportL1(residuals_.mean_l1);
      const double before = position_.last_l1;
      position_.last_l1 = residuals_.mean_l1;
      if (position_.round > 0 &&
          before - residuals_.mean_l1 < run_.options.objective_tolerance * before) {
        break;
      }
      InvertBlocks();
      Iterate();
      ++position_.round;
      EndRound();
    }
  }

 private:
  struct Position {
    int sweep = 0;
    int round = 0;
    int64_t iteration = 0;  // passes over all views
    double last_l1 = 0.0;   // of the round before
    double earlier_seconds = 0.0;
  };
  using Pair = std::array<double, 2>;  // of a', b'

  double Seconds() const { return position_.earlier_seconds + run_.clock.Seconds(); }
  bool OutOfTime() const { return run_.OutOfTime(Seconds()); }
  bool Ended() const { return position_.iteration >= run_.options.iterations || OutOfTime(); }

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

  // Rounded to float, so that going on from a checkpoint gives the same bytes. Splats that hide
  // each other can cancel with chroma that no colour has: kept within what Lab needs.
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
    robust.on = run_.options.robust;
    return robust;
  }

  void ReportL1(double mean_l1) {
    run_.progress.OnError(position_.iteration, "train_l1_ab", 255.0 * mean_l1);
    run_.progress.OnProgress(position_.iteration,
                             run_.options.iterations,
                             "chroma on " + std::to_string(system_.count()) + " Gaussians");
  }

  void EndRound() {
    ToParameters();
    run_.Snapshot(position_.iteration, parameters_);
    Save();
  }

  double Pull(int k) const {
    return run_.options.tikhonov * kShDc * kShDc * (k == 0 ? 1.0 : run_.options.tikhonov_rest);
  }

  // Inverse of the regularised diagonal blocks: block Jacobi.
  void InvertBlocks() {
    const int n = parameters_.coefficients();
    run_.pool.ForRanges(2 * system_.count(), [&](int64_t begin, int64_t end, int) {
      for (int64_t i = begin; i < end; ++i) {
        using Block = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, 4, 4>;
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
      run_.progress.OnError(position_.iteration,
                            "chroma_residual",
                            std::sqrt((rho[0] + rho[1]) / (right[0] + right[1])));
    }
    p = z;
    const double stop = run_.options.residual_tolerance * run_.options.residual_tolerance;
    for (int step = 0; step < run_.options.steps_per_round && !Ended(); ++step) {
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
      ++position_.iteration;
    }
  }

  std::string Fingerprint() const {
    const ChromaOptions& o = run_.options;
    char text[256];
    std::snprintf(text,
                  sizeof(text),
                  "chroma cg %d %d %g %g %g %g %d %d %d %d %zu %lld",
                  o.iterations,
                  o.chroma_sh_degree,
                  o.residual_tolerance,
                  o.objective_tolerance,
                  o.tikhonov,
                  o.tikhonov_rest,
                  o.robust ? 1 : 0,
                  o.sweeps,
                  o.rounds,
                  o.steps_per_round,
                  run_.problem.training.size(),
                  static_cast<long long>(system_.count()));
    return text;
  }

  // Between rounds only. `order` carries the sweeps and rounds that are done.
  void Save() {
    if (!run_.checkpoints.WantsSave()) return;
    TrainingState state;
    state.parameters = parameters_.block;
    state.iteration = position_.iteration;
    state.order = {position_.sweep, position_.round};
    state.mean_error = position_.last_l1;
    state.elapsed_seconds = Seconds();
    run_.checkpoints.Save(SerializeTrainingState(state, Fingerprint()));
  }

  void Resume() {
    const std::optional<std::string> saved = run_.checkpoints.Load();
    if (!saved) return;
    TrainingState state;
    if (!ParseTrainingState(*saved, Fingerprint(), state) || state.order.size() != 2 ||
        state.parameters.rows() != parameters_.block.rows() ||
        state.parameters.count() != parameters_.block.count()) {
      run_.progress.OnWarning(
          "chroma: the checkpoint belongs to other options or is damaged; fitting starts afresh");
      return;
    }
    parameters_.block = state.parameters;
    x_ = FromParameters();
    position_.sweep = state.order[0];
    position_.round = state.order[1];
    position_.iteration = state.iteration;
    position_.last_l1 = state.mean_error;
    position_.earlier_seconds = state.elapsed_seconds;
  }

  const ChromaRun& run_;
  const std::vector<char>& seen_;
  ChromaSystem& system_;
  ChromaParameters& parameters_;
  Position position_;
  ChromaVector x_, first_;
  ChromaSystem::Residuals residuals_;
};

}  // namespace

void SolveChroma(const ChromaRun& run,
                 const std::vector<char>& seen,
                 ChromaSystem& system,
                 ChromaParameters& parameters) {
  ChromaSolver(run, seen, system, parameters).Solve();
}

}  // namespace color3d
