#include "core/keycolor/grid_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <chrono>
#include <cmath>

#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

void Ignore(int, double) {}

// Weights over `decades` powers of ten, data on every `step`-th pixel.
GridSystem RandomSystem(int width, int height, double decades, int step, uint64_t seed) {
  Random random(seed);
  GridSystem s(width, height);
  auto weight = [&] { return std::pow(10.0, -decades * random.NextUniform()); };
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const int i = y * width + x;
      if (x + 1 < width) s.right[i] = weight();
      if (y + 1 < height) s.down[i] = weight();
      if (x + 1 < width && y + 1 < height) s.down_right[i] = weight();
      if (x > 0 && y + 1 < height) s.down_left[i] = weight();
      if (i % step == 0) s.data[i] = 1000.0;
    }
  }
  return s;
}

std::vector<double> RandomTarget(const GridSystem& s, uint64_t seed) {
  Random random(seed);
  std::vector<double> target(2 * s.data.size());
  for (double& value : target) value = random.NextUniform(-80.0, 80.0);
  return target;
}

// The dense matrix, assembled edge by edge from the definition, solved directly.
Eigen::MatrixXd DenseSolve(const GridSystem& s, const std::vector<double>& target) {
  const int n = static_cast<int>(s.data.size());
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  Eigen::MatrixXd b(n, 2);
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
      for (int c = 0; c < 2; ++c) b(i, c) = s.data[i] * target[2 * i + c];
    }
  }
  return a.ldlt().solve(b);
}

TEST(GridSolverTest, AgreesWithADenseSolve) {
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
    const std::vector<double> target = RandomTarget(system, 2);
    const GridSolution solution = SolveGridSystem(system, target, 1e-12, 1000, Ignore, {});
    EXPECT_TRUE(solution.converged) << c.width << "x" << c.height;
    const Eigen::MatrixXd direct = DenseSolve(system, target);
    for (int i = 0; i < direct.rows(); ++i) {
      ASSERT_NEAR(solution.u[2 * i], direct(i, 0), 1e-6) << c.width << "x" << c.height;
      ASSERT_NEAR(solution.u[2 * i + 1], direct(i, 1), 1e-6);
    }
  }
}

TEST(GridSolverTest, ConstantTargetGivesAConstant) {
  const GridSystem system = RandomSystem(60, 45, 5, 700, 3);
  const std::vector<double> target(2 * system.data.size(), 37.5);
  const GridSolution solution = SolveGridSystem(system, target, 1e-10, 1000, Ignore, {});
  for (double value : solution.u) ASSERT_NEAR(value, 37.5, 1e-5);
}

TEST(GridSolverTest, ZeroTargetNeedsNoIteration) {
  const GridSystem system = RandomSystem(30, 30, 1, 100, 3);
  const std::vector<double> target(2 * system.data.size(), 0.0);
  const GridSolution solution = SolveGridSystem(system, target, 1e-10, 1000, Ignore, {});
  EXPECT_EQ(solution.iterations, 0);
  EXPECT_TRUE(solution.converged);
}

TEST(GridSolverTest, MaximumPrincipleHolds) {
  const GridSystem system = RandomSystem(70, 70, 4, 1000, 5);
  const std::vector<double> target = RandomTarget(system, 6);
  double low = 1e9, high = -1e9;
  for (size_t i = 0; i < system.data.size(); ++i) {
    if (system.data[i] == 0.0) continue;
    low = std::min({low, target[2 * i], target[2 * i + 1]});
    high = std::max({high, target[2 * i], target[2 * i + 1]});
  }
  const GridSolution solution = SolveGridSystem(system, target, 1e-10, 1000, Ignore, {});
  for (double value : solution.u) {
    ASSERT_GE(value, low - 1e-4);
    ASSERT_LE(value, high + 1e-4);
  }
}

TEST(GridSolverTest, AMegapixelConvergesInFewIterations) {
  // Edge weights over three decades and one hint in 100 000 pixels.
  const GridSystem system = RandomSystem(1024, 1024, 3, 100003, 7);
  const std::vector<double> target = RandomTarget(system, 8);
  const GridSolution solution = SolveGridSystem(system, target, 1e-6, 2000, Ignore, {});
  EXPECT_TRUE(solution.converged);
  EXPECT_LT(solution.iterations, 60);
  RecordProperty("iterations", solution.iterations);
}

TEST(GridSolverTest, StopsWhenCancelledOrOutOfIterations) {
  const GridSystem system = RandomSystem(50, 50, 3, 1000, 7);
  const std::vector<double> target = RandomTarget(system, 8);
  CancellationToken cancel;
  cancel.Cancel();
  EXPECT_THROW(SolveGridSystem(system, target, 1e-9, 100, Ignore, cancel), Error);
  const GridSolution solution = SolveGridSystem(system, target, 1e-12, 1, Ignore, {});
  EXPECT_FALSE(solution.converged);
  EXPECT_EQ(solution.iterations, 1);
}

}  // namespace
}  // namespace color3d
