#include "core/splat/model/spherical_harmonics.h"

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace color3d {
namespace {

TEST(SphericalHarmonicsTest, GradientAgreesWithFiniteDifferences) {
  Random random(4);
  for (const int coefficients : {1, 4, 9, 16}) {
    double weight[16], d[3];
    for (double& w : weight) w = random.NextNormal();
    for (double& v : d) v = random.NextNormal();
    double analytic[3];
    ShGradient(coefficients, d[0], d[1], d[2], weight, analytic);
    for (int axis = 0; axis < 3; ++axis) {
      double basis[16], sums[2] = {0.0, 0.0};
      for (int side = 0; side < 2; ++side) {
        double e[3] = {d[0], d[1], d[2]};
        e[axis] += side == 0 ? 1e-6 : -1e-6;
        EvaluateSh(coefficients, e[0], e[1], e[2], basis);
        for (int k = 0; k < coefficients; ++k) sums[side] += weight[k] * basis[k];
      }
      EXPECT_NEAR(analytic[axis], (sums[0] - sums[1]) / 2e-6, 1e-6);
    }
  }
}

}  // namespace
}  // namespace color3d
