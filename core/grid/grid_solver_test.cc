#include "core/grid/grid_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/simd/instruction_set.h"

namespace color3d {
namespace {

// Every test runs on each instruction set of this machine.
class GridSolverTest : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    LimitInstructionSet(GetParam());
    ASSERT_EQ(ActiveInstructionSet(), GetParam());
  }
  void TearDown() override { LimitInstructionSet(""); }
};

INSTANTIATE_TEST_SUITE_P(InstructionSets,
                         GridSolverTest,
                         testing::ValuesIn(SupportedInstructionSets()),
                         [](const auto& test) { return test.param; });

// Weights over `decades` powers of ten, data on every `step`-th pixel, pinned on its neighbour.
GridSystem RandomSystem(int width, int height, double decades, int step, uint64_t seed) {
  Random random(seed);
  GridSystem s(width, height);
  auto weight = [&] { return static_cast<float>(std::pow(10.0, -decades * random.NextUniform())); };
  s.pinned.assign(s.PixelCount(), 0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int64_t i = y * width + x;
      if (x + 1 < width) s.right[i] = weight();
      if (y + 1 < height) s.down[i] = weight();
      if (x + 1 < width && y + 1 < height) s.down_right[i] = weight();
      if (x > 0 && y + 1 < height) s.down_left[i] = weight();
      if (i % step == 0) s.data[i] = 10.0f;
      if (i % step == 1) s.pinned[i] = 1;
    }
  }
  return s;
}

std::vector<float> RandomTarget(const GridSystem& s, uint64_t seed) {
  Random random(seed);
  std::vector<float> target(2 * s.PixelCount());
  for (float& value : target) value = static_cast<float>(random.NextUniform(-80.0, 80.0));
  return target;
}

GridSolution Solve(GridSystem system,
                   const std::vector<float>& target,
                   const GridSolveOptions& options,
                   int threads = 2) {
  ThreadPool pool(threads);
  return SolveGridSystem(std::move(system), target, options, pool, [](int, double) {}, {});
}

// The dense float64 matrix, assembled edge by edge from the definition, solved directly.
Eigen::MatrixXd DenseSolve(const GridSystem& s, const std::vector<float>& target) {
  const auto n = static_cast<int>(s.PixelCount());
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(n, 2);
  auto add = [&](int i, int j, double w) {
    a(i, i) += w;
    a(j, j) += w;
    a(i, j) -= w;
    a(j, i) -= w;
  };
  for (int y = 0; y < s.height; ++y) {
    for (int x = 0; x < s.width; ++x) {
      const int i = y * s.width + x;
      if (x + 1 < s.width) add(i, i + 1, s.right[i]);
      if (y + 1 < s.height) add(i, i + s.width, s.down[i]);
      if (x + 1 < s.width && y + 1 < s.height) add(i, i + s.width + 1, s.down_right[i]);
      if (x > 0 && y + 1 < s.height) add(i, i + s.width - 1, s.down_left[i]);
      a(i, i) += s.data[i];
      for (int c = 0; c < 2; ++c) b(i, c) += s.data[i] * target[i + c * n];
    }
  }
  for (int i = 0; i < n; ++i) {
    if (!s.pinned[i]) continue;
    a.row(i).setZero();
    a(i, i) = 1.0;
    for (int c = 0; c < 2; ++c) b(i, c) = target[i + c * n];
  }
  return a.partialPivLu().solve(b);
}

TEST_P(GridSolverTest, HierarchyServesSeveralPinsDataAndTargets) {
  const GridSystem edges = RandomSystem(23, 17, 3.0, 1000, 5);
  ThreadPool pool(2);
  GridHierarchy hierarchy(edges, pool, {});
  EXPECT_GT(hierarchy.bytes(), 23 * 17 * 20);
  for (const int step : {7, 31, 150}) {
    const GridSystem other = RandomSystem(23, 17, 3.0, step, 5);  // draws the same edges
    const std::vector<float> target = RandomTarget(other, step);
    GridSystem system = edges;
    system.data = other.data;
    system.pinned = other.pinned;
    const Eigen::MatrixXd exact = DenseSolve(system, target);
    const GridSolution solved =
        hierarchy.Solve(other.pinned, &other.data, target, {1e-6, 200}, [](int, double) {}, {});
    EXPECT_TRUE(solved.converged);
    for (int64_t i = 0; i < system.PixelCount(); ++i) {
      for (int c = 0; c < 2; ++c) {
        EXPECT_NEAR(solved.u[i + c * system.PixelCount()], exact(i, c), 0.05) << step << " " << i;
      }
    }
  }
}

TEST_P(GridSolverTest, AgreesWithDenseSolve) {
  struct Case {
    int width, height;
    double decades;
    int step;
  };
  for (const Case& c : {Case{23, 17, 0, 50},
                        {31, 12, 4, 100},
                        {1, 40, 2, 39},
                        {40, 1, 2, 39},
                        {2, 2, 0, 4},
                        {1, 1, 0, 1},
                        {24, 24, 5, 575}}) {
    const GridSystem system = RandomSystem(c.width, c.height, c.decades, c.step, 1);
    const std::vector<float> target = RandomTarget(system, 2);
    const GridSolution solution = Solve(system, target, {1e-6, 1000});
    EXPECT_LT(solution.relative_residual, 1e-5) << c.width << "x" << c.height;
    const Eigen::MatrixXd direct = DenseSolve(system, target);
    const Eigen::Index n = direct.rows();
    for (Eigen::Index i = 0; i < n; ++i) {
      ASSERT_NEAR(solution.u[i], direct(i, 0), 0.01) << c.width << "x" << c.height;
      ASSERT_NEAR(solution.u[i + n], direct(i, 1), 0.01);
    }
  }
}

TEST_P(GridSolverTest, ConstantTargetGivesConstant) {
  const GridSystem system = RandomSystem(60, 45, 5, 700, 3);
  const std::vector<float> target(2 * system.PixelCount(), 37.5f);
  for (float value : Solve(system, target, {1e-6, 1000}).u) ASSERT_NEAR(value, 37.5f, 1e-2);
}

TEST_P(GridSolverTest, ZeroTargetNeedsNoIteration) {
  const GridSystem system = RandomSystem(30, 30, 1, 100, 3);
  const std::vector<float> target(2 * system.PixelCount(), 0.0f);
  const GridSolution solution = Solve(system, target, {1e-6, 1000});
  EXPECT_EQ(solution.iterations, 0);
  EXPECT_TRUE(solution.converged);
}

TEST_P(GridSolverTest, MaximumPrincipleHolds) {
  const GridSystem system = RandomSystem(70, 70, 4, 1000, 5);
  const std::vector<float> target = RandomTarget(system, 6);
  float low = 1e9f, high = -1e9f;
  for (int64_t i = 0; i < system.PixelCount(); ++i) {
    if (system.data[i] == 0.0f && !system.pinned[i]) continue;
    low = std::min({low, target[i], target[i + system.PixelCount()]});
    high = std::max({high, target[i], target[i + system.PixelCount()]});
  }
  for (float value : Solve(system, target, {1e-6, 1000}).u) {
    ASSERT_GE(value, low - 1e-2f);
    ASSERT_LE(value, high + 1e-2f);
  }
}

TEST_P(GridSolverTest, PinnedPixelsAreExact) {
  const GridSystem system = RandomSystem(64, 48, 3, 10, 5);
  const std::vector<float> target = RandomTarget(system, 6);
  const GridSolution solution = Solve(system, target, {1e-2, 1});
  for (int64_t i = 0; i < system.PixelCount(); ++i) {
    if (!system.pinned[i]) continue;
    ASSERT_EQ(solution.u[i], target[i]);
    ASSERT_EQ(solution.u[i + system.PixelCount()], target[i + system.PixelCount()]);
  }
}

TEST_P(GridSolverTest, PinnedRowsSplitPicture) {
  // Regions that are connected to pinned pixels only, and one without any connection.
  GridSystem system = RandomSystem(96, 96, 2, 96 * 96 - 1, 9);
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 96; ++x) system.pinned[y * 96 + x] = x % 4 == 0 || y % 4 == 0;
  }
  const std::vector<float> target = RandomTarget(system, 10);
  const GridSolution solution = Solve(system, target, {1e-6, 100});
  EXPECT_LT(solution.relative_residual, 1e-5);
  EXPECT_LT(solution.iterations, 30);
  std::fill(system.pinned.begin(), system.pinned.end(), 1);
  EXPECT_EQ(Solve(system, target, {1e-6, 100}).u, target);
}

TEST_P(GridSolverTest, CoarsensStarGraphs) {
  // One huge, tightly connected region with 10^4 isolated specks.
  GridSystem system(300, 300);
  for (int64_t i = 0; i < system.PixelCount(); ++i) {
    const int64_t x = i % 300, y = i / 300;
    const bool speck = x % 3 == 1 && y % 3 == 1;
    const bool right_speck = (x + 1) % 3 == 1 && y % 3 == 1;
    const bool down_speck = x % 3 == 1 && (y + 1) % 3 == 1;
    if (x + 1 < 300) system.right[i] = speck || right_speck ? 1e-6f : 1.0f;
    if (y + 1 < 300) system.down[i] = speck || down_speck ? 1e-6f : 1.0f;
  }
  system.data[0] = 1.0f;
  std::vector<float> target(2 * system.PixelCount(), 0.0f);
  target[0] = 50.0f;
  const GridSolution solution = Solve(system, target, {1e-5, 100});
  EXPECT_LT(solution.iterations, 40);
  for (int64_t i = 0; i < system.PixelCount(); ++i) ASSERT_NEAR(solution.u[i], 50.0f, 0.5f);
}

TEST_P(GridSolverTest, IsBitwiseIndependentOfThreads) {
  const GridSystem system = RandomSystem(700, 500, 3, 5003, 7);
  const std::vector<float> target = RandomTarget(system, 8);
  const GridSolution one = Solve(system, target, {1e-3, 200}, 1);
  EXPECT_EQ(one.u, Solve(system, target, {1e-3, 200}, 3).u);
}

TEST_P(GridSolverTest, MegapixelConvergesInFewIterations) {
  // Edge weights over six decades and one hint in 100 000 pixels.
  const GridSystem system = RandomSystem(1024, 1024, 6, 100003, 7);
  const std::vector<float> target = RandomTarget(system, 8);
  const GridSolution solution = Solve(system, target, {1e-4, 200});
  EXPECT_TRUE(solution.converged);
  EXPECT_LT(solution.iterations, 40);
  RecordProperty("iterations", solution.iterations);
}

TEST_P(GridSolverTest, StopsWhenCancelledOrOutOfIterations) {
  const GridSystem system = RandomSystem(50, 50, 3, 1000, 7);
  const std::vector<float> target = RandomTarget(system, 8);
  CancellationToken cancel;
  cancel.Cancel();
  ThreadPool pool(1);
  EXPECT_THROW(SolveGridSystem(
                   GridSystem(system), target, {1e-6, 9}, pool, [](int, double) {}, cancel),
               Error);
  const GridSolution solution = Solve(system, target, {1e-6, 1});
  EXPECT_FALSE(solution.converged);
  EXPECT_EQ(solution.iterations, 1);
}

}  // namespace
}  // namespace color3d
