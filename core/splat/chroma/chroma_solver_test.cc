// The chroma solvers against float64.
#include "core/splat/chroma/chroma_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <atomic>
#include <cmath>
#include <utility>

#include "core/base/error.h"
#include "core/splat/chroma/chroma_fit.h"
#include "core/splat/chroma/chroma_parameters.h"
#include "core/splat/chroma/chroma_system.h"
#include "core/splat/model/spherical_harmonics.h"
#include "core/splat/raster/raster_camera.h"
#include "tests/reference/splat.h"
#include "tests/support/scenes/chroma_problems.h"

namespace color3d {
namespace {

using chroma_problems::Fit;
using chroma_problems::RandomGaussians;
using chroma_problems::RandomProblem;

// W of one view by the float64 renderer: one picture per coefficient, with the others 0.
Eigen::MatrixXd DenseWeights(const GaussianModel& geometry, int degree, const PosedCamera& view) {
  const ChromaParameters p = ChromaParameters::From(geometry, degree);
  const int n = p.coefficients();
  ColorSpec color;
  color.channel[0] = {kColorRow, n, 0.0f, false};
  ReferenceParameters reference = ReferenceParameters::From(p.block);
  Eigen::MatrixXd w(view.camera.width * view.camera.height, n * p.block.count());
  for (int64_t i = 0; i < p.block.count(); ++i) {
    for (int k = 0; k < n; ++k) {
      reference.At(kColorRow + k, static_cast<int>(i)) = 1.0;
      const ReferenceImage image = ReferenceRender(
          reference, color, MakeRasterCamera(view.camera, view.cam_from_world), {0.0});
      reference.At(kColorRow + k, static_cast<int>(i)) = 0.0;
      for (size_t j = 0; j < image.color[0].size(); ++j) {
        w(static_cast<int>(j), i * n + k) = image.color[0][j];
      }
    }
  }
  return w;
}

// The regularised least squares of one channel by a dense Cholesky factorisation.
Eigen::VectorXd DenseSolution(const GaussianModel& geometry,
                              const ChromaProblem& problem,
                              const ChromaOptions& options,
                              int channel,
                              const Eigen::VectorXd& first) {
  const int n = ShCoefficients(options.chroma_sh_degree);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(first.size(), first.size());
  Eigen::VectorXd right = Eigen::VectorXd::Zero(first.size());
  for (const PosedCamera& view : problem.training) {
    const Eigen::MatrixXd w = DenseWeights(geometry, options.chroma_sh_degree, view);
    const auto target = problem.targets(view.view);
    Eigen::VectorXd t(w.rows()), d(w.rows());
    for (int j = 0; j < w.rows(); ++j) {
      t[j] = target->ab.Plane(channel)[j] / 255.0;
      d[j] = target->weight.data[j];
    }
    normal += w.transpose() * d.asDiagonal() * w;
    right += w.transpose() * d.asDiagonal() * t;
  }
  for (int j = 0; j < first.size(); ++j) {
    const double pull =
        options.tikhonov * kShDc * kShDc * (j % n == 0 ? 1.0 : options.tikhonov_rest);
    normal(j, j) += pull;
    right[j] += pull * first[j];
  }
  return normal.ldlt().solve(right);
}

class ChromaSolverTest : public testing::TestWithParam<int> {};

TEST_P(ChromaSolverTest, AgreesWithDenseFactorization) {
  const GaussianModel geometry = RandomGaussians(40, 3);
  const ChromaProblem problem = RandomProblem(3, 5);
  ChromaOptions options;
  options.chroma_sh_degree = GetParam();
  options.iterations = 0;
  const GaussianModel closed = Fit(geometry, problem, options);
  options.iterations = 1000;
  options.robust = false;
  options.sweeps = 0;
  options.rounds = 3;
  options.steps_per_round = 300;
  options.residual_tolerance = 1e-9;
  options.objective_tolerance = 0.0;
  options.tikhonov = 1.0;
  const GaussianModel model = Fit(geometry, problem, options);
  for (int c = 0; c < 2; ++c) {
    const auto vector = [&](const GaussianModel& m) -> Eigen::VectorXd {
      const std::vector<float>& v = c == 0 ? m.sh_a : m.sh_b;
      return Eigen::Map<const Eigen::VectorXf>(v.data(), static_cast<int>(v.size())).cast<double>();
    };
    const Eigen::VectorXd expected = DenseSolution(geometry, problem, options, c, vector(closed));
    EXPECT_LT((vector(model) - expected).norm(), 1e-3 * expected.norm());
    EXPECT_GT((vector(closed) - expected).norm(), 0.05 * expected.norm());  // the check can fail
  }
}

INSTANTIATE_TEST_SUITE_P(Degrees, ChromaSolverTest, testing::Values(0, 1, 3));

TEST(FitChromaTest, ConjugateGradientsBeatClosedFormAndAdam) {
  const GaussianModel geometry = RandomGaussians(60, 4);
  const ChromaProblem problem = RandomProblem(3, 6);
  std::vector<double> l1;
  for (const int run : {0, 1, 2}) {
    ChromaOptions options;
    options.iterations = run == 0 ? 0 : 60;
    if (run == 2) options.solver = ChromaOptions::Solver::kAdam;
    const GaussianModel model = Fit(geometry, problem, options);
    double sum = 0.0, total = 0.0;
    for (const PosedCamera& view : problem.training) {
      const Eigen::MatrixXd w = DenseWeights(geometry, 0, view);
      const auto target = problem.targets(view.view);
      const Eigen::VectorXd a =
          w * Eigen::Map<const Eigen::VectorXf>(model.sh_a.data(), w.cols()).cast<double>();
      for (int j = 0; j < w.rows(); ++j) {
        sum += target->weight.data[j] * std::abs(255.0 * a[j] - target->ab.data[j]);
        total += target->weight.data[j];
      }
    }
    l1.push_back(sum / total);
  }
  EXPECT_LT(l1[1], l1[0]);
  EXPECT_LE(l1[1], l1[2] * 1.001);
}

TEST(FitChromaTest, MemoryBudgetDoesNotChangeBytes) {
  const GaussianModel geometry = RandomGaussians(60, 4);
  const ChromaProblem problem = RandomProblem(3, 6);
  ChromaOptions options;
  options.chroma_sh_degree = 1;
  const GaussianModel kept = Fit(geometry, problem, options);
  EXPECT_EQ(Fit(geometry, problem, options).sh_a, kept.sh_a);
  for (const int64_t targets : {int64_t{0}, int64_t{1} << 20}) {
    for (const int64_t budget : {int64_t{0}, int64_t{150'000}}) {  // none, or some of the views
      options.memory_budget_bytes = budget;
      options.target_budget_bytes = targets;
      EXPECT_EQ(Fit(geometry, problem, options).sh_a, kept.sh_a);
    }
  }
}

// The caches stay within their budgets for any number of views; each pass requests the other
// targets again.
TEST(FitChromaTest, CacheSizeIsIndependentOfViewCount) {
  const GaussianModel geometry = RandomGaussians(60, 4);
  constexpr int64_t kBudget = 150'000, kTargetBudget = 40'000;
  for (const int views : {12, 48}) {
    ChromaProblem problem = RandomProblem(views, 6);
    std::atomic<int> asked = 0;
    problem.targets = [&, source = problem.targets](int view) {
      ++asked;
      return source(view);
    };
    ThreadPool pool(2);
    const ChromaParameters parameters = ChromaParameters::From(geometry, 0);
    GeometryInTime in_time(geometry, pool);
    ChromaTargets targets(problem, kTargetBudget);
    ChromaSystem system(parameters.block, parameters.color, in_time, targets, kBudget, pool);
    int kept = 0;
    for (const PosedCamera& view : problem.training) {
      ChromaPlanes planes;
      ASSERT_TRUE(LoadChromaPlanes(problem, view, &planes));
      if (system.AddView(view, planes, true)) {
        ++kept;
      } else {
        targets.Offer(view, std::move(planes));
      }
    }
    EXPECT_GT(kept, 1);
    EXPECT_LE(system.kept_bytes(), kBudget);
    EXPECT_GT(system.kept_bytes(), kBudget / 2);
    EXPECT_LE(targets.kept_bytes(), kTargetBudget);
    EXPECT_GT(targets.kept_bytes(), kTargetBudget / 2);
    EXPECT_EQ(asked, views);
    ChromaVector x(2 * static_cast<size_t>(system.count()), 0.1);
    system.Sweep({}, 1.0, 1.0, std::vector<char>(system.count(), 1), CancellationToken(), x);
    EXPECT_GT(asked, views);
    EXPECT_LT(asked, 2 * views);
    EXPECT_LE(targets.kept_bytes(), kTargetBudget);
  }
}

class LastSave : public CheckpointStore {
 public:
  explicit LastSave(int stop_after) : stop_after_(stop_after) {}
  std::optional<std::string> Load() override { return state_; }
  bool WantsSave() override { return true; }
  void Save(const std::string& state) override {
    state_ = state;
    if (--stop_after_ == 0) throw Error(ErrorCode::kAborted, "stopped");
  }

 private:
  int stop_after_;
  std::optional<std::string> state_;
};

TEST(FitChromaTest, ResumesFromCheckpointWithSameBytes) {
  const GaussianModel geometry = RandomGaussians(60, 4);
  const ChromaProblem problem = RandomProblem(3, 6);
  for (const auto solver :
       {ChromaOptions::Solver::kConjugateGradients, ChromaOptions::Solver::kAdam}) {
    ChromaOptions options;
    options.solver = solver;
    options.iterations = 40;
    options.sweeps = 6;
    options.objective_tolerance = 0.0;
    const GaussianModel whole = Fit(geometry, problem, options);
    for (const int stop_after : {1, 5, 7}) {
      ThreadPool pool(2);
      LastSave store(stop_after);
      NullObserver observer;
      CancellationToken cancel;
      const RunControl run{pool, store, observer, cancel};
      EXPECT_THROW(FitChroma(geometry, problem, options, run), Error);
      EXPECT_EQ(FitChroma(geometry, problem, options, run).sh_b, whole.sh_b);
    }
  }
}

}  // namespace
}  // namespace color3d
