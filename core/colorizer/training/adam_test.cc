#include "core/colorizer/training/adam.h"

#include <gtest/gtest.h>
#include <torch/types.h>

#include <cmath>
#include <limits>

namespace color3d {
namespace {

TEST(AdamTest, AgreesWithFormulaInFloat64) {
  torch::Tensor x = torch::tensor({3.0f, -2.0f}).requires_grad_(true);
  Adam adam({{"x", x}});
  double value[2] = {3.0, -2.0}, m[2] = {}, v[2] = {};
  for (int step = 1; step <= 20; ++step) {
    x.square().sum().backward();
    double gradient[2] = {2.0 * value[0], 2.0 * value[1]};
    const double norm = std::hypot(gradient[0], gradient[1]);
    EXPECT_NEAR(adam.Step(0.1, 1.5), norm, 1e-4);
    const double clip = norm > 1.5 ? 1.5 / norm : 1.0;
    for (int i = 0; i < 2; ++i) {
      m[i] = 0.9 * m[i] + 0.1 * gradient[i] * clip;
      v[i] = 0.999 * v[i] + 0.001 * gradient[i] * gradient[i] * clip * clip;
      value[i] -= 0.1 * (m[i] / (1.0 - std::pow(0.9, step))) /
                  (std::sqrt(v[i] / (1.0 - std::pow(0.999, step))) + 1e-8);
      EXPECT_NEAR(x[i].item<double>(), value[i], 1e-4);
    }
  }
}

TEST(AdamTest, DoesNotClipAtNormZero) {
  torch::Tensor x = torch::tensor({3.0f}).requires_grad_(true);
  Adam adam({{"x", x}});
  (x * 50.0).sum().backward();
  adam.Step(0.1, 0.0);
  EXPECT_NEAR(adam.Moments()[0].second.item<float>(), 0.1f * 50.0f, 1e-4f);
}

TEST(AdamTest, IgnoresNonFiniteGradient) {
  torch::Tensor x = torch::tensor({3.0f}).requires_grad_(true);
  Adam adam({{"x", x}});
  (x * std::numeric_limits<float>::quiet_NaN()).sum().backward();
  EXPECT_FALSE(std::isfinite(adam.Step(0.1, 1.0)));
  EXPECT_EQ(x.item<float>(), 3.0f);
  EXPECT_EQ(adam.steps(), 0);
}

}  // namespace
}  // namespace color3d
