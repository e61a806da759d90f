// Adam against its formula in float64, once per instruction set.
#include "core/splat/training/adam.h"

#include <cmath>
#include <limits>

#include "tests/support/instruction_set_testing.h"
#include "tests/support/random_block.h"

namespace color3d {
namespace {

constexpr int kRows = kBlockRows;
constexpr int kCount = kBlockCount;

using AdamTest = InstructionSetTest<int>;  // of thread counts

TEST_P(AdamTest, AgreesWithFormula) {
  ThreadPool pool(TestCase());
  ParameterBlock p = RandomBlock(1, 1.0);
  AdamMoments moments{ParameterBlock(kRows, kCount), ParameterBlock(kRows, kCount)};
  std::vector<float> rates(kRows, 0.01f);
  rates[3] = 0.0f;
  std::vector<double> x(p.values().begin(), p.values().end()), m(x.size()), v(x.size());
  const ParameterBlock before = p;
  for (int step = 1; step <= 5; ++step) {
    const ParameterBlock g = RandomBlock(10 + step, std::pow(10.0, step - 3));
    ASSERT_TRUE(AdamStep(g, rates, step, pool, p, moments));
    for (size_t k = 0; k < x.size(); ++k) {
      const double gradient = g.values()[k];
      m[k] = 0.9 * m[k] + 0.1 * gradient;
      v[k] = 0.999 * v[k] + 0.001 * gradient * gradient;
      x[k] -= 0.01 * m[k] / (1.0 - std::pow(0.9, step)) /
              (std::sqrt(v[k] / (1.0 - std::pow(0.999, step))) + 1e-15);
    }
  }
  for (int r = 0; r < kRows; ++r) {
    for (int i = 0; i < kCount; ++i) {
      const double expected = r == 3 ? before.Row(r)[i] : x[r * p.stride() + i];
      EXPECT_NEAR(p.Row(r)[i], expected, 1e-5) << r << " " << i;
    }
  }
}

TEST_P(AdamTest, ReportsNonFiniteValues) {
  ThreadPool pool(TestCase());
  for (const float bad :
       {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    ParameterBlock p = RandomBlock(1, 1.0), g = RandomBlock(2, 1.0);
    AdamMoments moments{ParameterBlock(kRows, kCount), ParameterBlock(kRows, kCount)};
    g.Row(kRows - 1)[kCount - 1] = bad;
    EXPECT_FALSE(AdamStep(g, std::vector<float>(kRows, 0.01f), 1, pool, p, moments));
  }
}

INSTANTIATE_TEST_SUITE_P(Threads,
                         AdamTest,
                         testing::Combine(testing::Values(1, 3), EachInstructionSet()));

}  // namespace
}  // namespace color3d
