// Motion and its adjoint against a float64 reference, once per instruction set.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/base/random.h"
#include "core/splat/motion/motion.h"
#include "tests/support/instruction_set_testing.h"

namespace color3d {
namespace {

constexpr int kRows = 12;  // position, scale, rotation, opacity and one number of colour
constexpr int64_t kStill = 5;
constexpr int64_t kMoving = 23;

// One Gaussian that moves, in float64: parameters, then motion. Returns its rows at `t`.
std::vector<double> ReferenceMotion(const std::vector<double>& p, double t) {
  std::vector<double> at(p.begin(), p.begin() + kRows);
  const double* m = p.data() + kRows;
  const double tau = t - m[kCenterRow], scaled = tau / std::exp(m[kLogWidthRow]);
  for (int k = 0; k < 3; ++k) {
    at[kPositionRow + k] += m[kVelocityRow + k] * tau + m[kAccelerationRow + k] * tau * tau;
  }
  for (int k = 0; k < 4; ++k) at[kRotationRow + k] += m[kSpinRow + k] * tau;
  const double opacity = std::exp(-0.5 * scaled * scaled) / (1.0 + std::exp(-p[kOpacityRow]));
  at[kOpacityRow] = std::log(opacity / (1.0 - opacity));
  return at;
}

ParameterBlock RandomRows(int rows, int64_t count, uint64_t seed) {
  ParameterBlock block(rows, count);
  Random random(seed);
  for (int r = 0; r < rows; ++r) {
    for (int64_t i = 0; i < count; ++i) block.Row(r)[i] = static_cast<float>(random.NextNormal());
  }
  return block;
}

std::vector<double> Column(const ParameterBlock& block, int64_t i) {
  std::vector<double> column;
  for (int r = 0; r < block.rows(); ++r) column.push_back(block.Row(r)[i]);
  return column;
}

class ApplyMotionTest : public InstructionSetTest<int> {  // of thread counts
 protected:
  ApplyMotionTest() {
    for (int64_t i = 0; i < kMoving; ++i) {
      // Visible at all tested times.
      moving_.Row(kRows + kLogWidthRow)[i] = 0.2f * moving_.Row(kRows + kLogWidthRow)[i];
      moving_.Row(kRows + kCenterRow)[i] = 0.5f * moving_.Row(kRows + kCenterRow)[i];
    }
  }

  // Static Gaussians, then moving ones at `t`.
  ParameterBlock At(float t) {
    ParameterBlock at = RandomRows(kRows, kStill + kMoving, 3);
    for (int r = 0; r < kRows; ++r) {
      for (int64_t i = 0; i < kMoving; ++i) at.Row(r)[kStill + i] = moving_.Row(r)[i];
    }
    ApplyMotion({moving_, kRows, t, kStill}, pool_, at);
    return at;
  }

  ThreadPool pool_{TestCase()};
  ParameterBlock moving_ = RandomRows(kRows + kMotionRows, kMoving, 1);
};

TEST_P(ApplyMotionTest, AgreesWithFloat64Reference) {
  for (const float t : {-1.0f, -0.3f, 0.0f, 1.0f}) {
    const ParameterBlock at = At(t), still = RandomRows(kRows, kStill + kMoving, 3);
    for (int64_t i = 0; i < kStill; ++i) EXPECT_EQ(Column(at, i), Column(still, i));
    for (int64_t i = 0; i < kMoving; ++i) {
      const std::vector<double> twin = ReferenceMotion(Column(moving_, i), t),
                                ours = Column(at, kStill + i);
      for (int r = 0; r < kRows; ++r) EXPECT_NEAR(ours[r], twin[r], 2e-5 * (1 + std::abs(twin[r])));
    }
  }
}

TEST_P(ApplyMotionTest, GradientAgreesWithFloat64Reference) {
  const ParameterBlock d_at = RandomRows(kRows, kStill + kMoving, 7);
  for (const float t : {-0.7f, 0.4f}) {
    ParameterBlock gradient;
    ApplyMotionBackward({moving_, kRows, t, kStill}, At(t), d_at, pool_, gradient);
    for (int64_t i = 0; i < kMoving; ++i) {
      const std::vector<double> d = Column(d_at, kStill + i), parameters = Column(moving_, i);
      const auto value = [&](const std::vector<double>& p) {
        const std::vector<double> at = ReferenceMotion(p, t);
        double sum = 0.0;
        for (int r = 0; r < kRows; ++r) sum += d[r] * at[r];
        return sum;
      };
      for (int r = 0; r < kRows + kMotionRows; ++r) {
        constexpr double kStep = 1e-5;
        std::vector<double> up = parameters, down = parameters;
        up[r] += kStep;
        down[r] -= kStep;
        const double expected = (value(up) - value(down)) / (2.0 * kStep);
        EXPECT_NEAR(gradient.Row(r)[i], expected, 1e-4 * (1.0 + std::abs(expected)))
            << "row " << r << " of Gaussian " << i << " at " << t;
      }
    }
  }
}

TEST_P(ApplyMotionTest, IsInvisibleFarFromItsTime) {
  for (int64_t i = 0; i < kMoving; ++i) {
    moving_.Row(kRows + kCenterRow)[i] = -1.0f;
    moving_.Row(kRows + kLogWidthRow)[i] = -20.0f;  // a window so narrow that its square overflows
  }
  const ParameterBlock at = At(1.0f);
  ParameterBlock d_at(kRows, kStill + kMoving), gradient;
  ApplyMotionBackward({moving_, kRows, 1.0f, kStill}, at, d_at, pool_, gradient);
  for (int64_t i = 0; i < kMoving; ++i) {
    EXPECT_LT(at.Row(kOpacityRow)[kStill + i], -9.0f);
    for (int r = 0; r < gradient.rows(); ++r) EXPECT_EQ(gradient.Row(r)[i], 0.0f);
  }
}

TEST_P(ApplyMotionTest, HidesGaussiansOfOneTime) {
  constexpr float kMoment = 0.2f, kHidden = 0.4f;
  ParameterBlock at = RandomRows(kRows, kStill + kMoving, 3);
  ApplyMotion({moving_, kRows, kMoment, kStill}, pool_, at, kHidden);
  int hidden = 0;
  for (int64_t i = 0; i < kMoving; ++i) {
    const bool near = std::abs(kMoment - moving_.Row(kRows + kCenterRow)[i]) < kHidden;
    EXPECT_EQ(at.Row(kOpacityRow)[kStill + i] == kUnseenLogit, near);
    hidden += near ? 1 : 0;
  }
  EXPECT_GT(hidden, 0);
  EXPECT_LT(hidden, kMoving);
}

INSTANTIATE_TEST_SUITE_P(Threads,
                         ApplyMotionTest,
                         testing::Combine(testing::Values(1, 3), EachInstructionSet()));

}  // namespace
}  // namespace color3d
