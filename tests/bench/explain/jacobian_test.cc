#include "tests/bench/explain/jacobian.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include <cmath>

#include "core/encoder/torch_threads.h"

namespace color3d {
namespace {

class JacobianNormTest : public testing::Test {
 protected:
  JacobianNormTest() { SetTorchThreads(1); }
};

TEST_F(JacobianNormTest, IsLargestSingularValueOfLinearMap) {
  // Rotation by 0.3, stretch by 5 and 2, into three dimensions.
  const double c = std::cos(0.3), s = std::sin(0.3);
  torch::Tensor matrix = torch::zeros({3, 2}, torch::kFloat64);
  matrix[0][0] = 5.0 * c;
  matrix[0][1] = -5.0 * s;
  matrix[2][0] = 2.0 * s;
  matrix[2][1] = 2.0 * c;
  const auto map = [&](const torch::Tensor& x) { return torch::mv(matrix, x); };
  EXPECT_NEAR(JacobianNorm(map, torch::ones({2}, torch::kFloat64), 40, 1), 5.0, 1e-6);
}

TEST_F(JacobianNormTest, DependsOnPlace) {
  const auto square = [](const torch::Tensor& x) { return x * x; };
  const torch::Tensor x = torch::full({4}, 0.5, torch::kFloat64);
  EXPECT_NEAR(JacobianNorm(square, x, 10, 2), 1.0, 1e-9);
  EXPECT_NEAR(JacobianNorm(square, 3.0 * x, 10, 2), 3.0, 1e-9);
}

TEST_F(JacobianNormTest, GrowsWithIterations) {
  torch::Tensor diagonal = torch::ones({50}, torch::kFloat64);
  diagonal[17] = 3.0;
  const auto map = [&](const torch::Tensor& x) { return diagonal * x; };
  const torch::Tensor x = torch::zeros({50}, torch::kFloat64);
  const double once = JacobianNorm(map, x, 1, 3);
  EXPECT_LT(once, 2.0);
  EXPECT_NEAR(JacobianNorm(map, x, 30, 3), 3.0, 1e-6);
}

TEST_F(JacobianNormTest, IsZeroForConstant) {
  const auto zero = [](const torch::Tensor& x) { return 0.0 * x; };
  EXPECT_EQ(JacobianNorm(zero, torch::ones({3}), 5, 1), 0.0);
}

}  // namespace
}  // namespace color3d
