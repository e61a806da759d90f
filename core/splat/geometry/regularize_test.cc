// The regularizers against their formulas in float64, once per instruction set.
#include "core/splat/geometry/regularize.h"

#include <cmath>

#include "tests/support/instruction_set_testing.h"
#include "tests/support/random_block.h"

namespace color3d {
namespace {

constexpr int kRows = kBlockRows;
constexpr int kCount = kBlockCount;

using RegularizeTest = InstructionSetTest<int>;  // of thread counts

TEST_P(RegularizeTest, PenaltyGradientsAgreeWithFormula) {
  ThreadPool pool(TestCase());
  const ParameterBlock p = RandomBlock(3, 2.0);
  ParameterBlock gradient(kRows, kCount);
  AddPenaltyGradients(p, 0.5f, 0.25f, pool, gradient);
  for (int i = 0; i < kCount; ++i) {
    const double opacity = 1.0 / (1.0 + std::exp(-double{p.Row(kOpacityRow)[i]}));
    EXPECT_NEAR(
        gradient.Row(kOpacityRow)[i], 0.5 * opacity * (1.0 - opacity) / kCount, 1e-6 / kCount);
    for (int k = 0; k < 3; ++k) {
      const double expected = 0.25 * std::exp(double{p.Row(kLogScaleRow + k)[i]}) / (3.0 * kCount);
      EXPECT_NEAR(gradient.Row(kLogScaleRow + k)[i], expected, 1e-6 * expected);
    }
  }
}

TEST_P(RegularizeTest, ShortensNeedlesButNotFlatGaussians) {
  ThreadPool pool(TestCase());
  ParameterBlock p(kRows, kCount);
  for (int i = 0; i < kCount; ++i) {
    const bool needle = i % 2 == 0;
    p.Row(kLogScaleRow + i % 3)[i] = needle ? 5.0f : -7.0f;  // the two other axes: 0
  }
  const ParameterBlock before = p;
  LimitNeedles(2.0f, pool, p);
  for (int i = 0; i < kCount; ++i) {
    for (int k = 0; k < 3; ++k) {
      const bool long_axis = i % 2 == 0 && k == i % 3;
      EXPECT_EQ(p.Row(kLogScaleRow + k)[i], long_axis ? 2.0f : before.Row(kLogScaleRow + k)[i]);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Threads,
                         RegularizeTest,
                         testing::Combine(testing::Values(1, 3), EachInstructionSet()));

}  // namespace
}  // namespace color3d
