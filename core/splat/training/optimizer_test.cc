// Adam and the regularizers against their formulas in float64, once per instruction set.
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/random.h"
#include "core/splat/training/adam.h"
#include "core/splat/training/regularize.h"
#include "tests/support/instruction_set_testing.h"

namespace color3d {
namespace {

constexpr int kRows = kColorRow + 1;
constexpr int kCount = 53;  // not a multiple of the vector

ParameterBlock RandomBlock(uint64_t seed, double scale) {
  Random random(seed);
  ParameterBlock p(kRows, kCount);
  for (int r = 0; r < kRows; ++r) {
    for (int i = 0; i < kCount; ++i) {
      p.Row(r)[i] = static_cast<float>(scale * random.NextNormal());
    }
  }
  return p;
}

using OptimizerTest = InstructionSetTest<int>;  // of thread counts

TEST_P(OptimizerTest, AdamAgreesWithItsFormula) {
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

TEST_P(OptimizerTest, SparseAdamLeavesUnseenGaussiansAlone) {
  ThreadPool pool(TestCase());
  const ParameterBlock before = RandomBlock(1, 1.0), g = RandomBlock(2, 1.0);
  std::vector<uint32_t> depth_keys(kCount, 0);
  for (int i = 0; i < kCount; ++i) depth_keys[i] = i < 16 || i % 3 == 1 ? 7 : 0;
  std::fill(depth_keys.begin() + 16, depth_keys.begin() + 32, 0);
  ParameterBlock dense = before, sparse = before;
  AdamMoments dense_moments{ParameterBlock(kRows, kCount), ParameterBlock(kRows, kCount)};
  AdamMoments sparse_moments = dense_moments;
  const std::vector<float> rates(kRows, 0.01f);
  ASSERT_TRUE(AdamStep(g, rates, 1, pool, dense, dense_moments));
  ASSERT_TRUE(AdamStep(g, rates, 1, pool, sparse, sparse_moments, &depth_keys));
  for (int r = 0; r < kRows; ++r) {
    for (int i = 0; i < kCount; ++i) {
      const bool seen = depth_keys[i] != 0;
      EXPECT_EQ(sparse.Row(r)[i], seen ? dense.Row(r)[i] : before.Row(r)[i]);
      EXPECT_EQ(sparse_moments.first.Row(r)[i], seen ? dense_moments.first.Row(r)[i] : 0.0f);
      EXPECT_EQ(sparse_moments.second.Row(r)[i], seen ? dense_moments.second.Row(r)[i] : 0.0f);
    }
  }
}

TEST_P(OptimizerTest, AdamReportsWhatIsNotFinite) {
  ThreadPool pool(TestCase());
  for (const float bad :
       {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
    ParameterBlock p = RandomBlock(1, 1.0), g = RandomBlock(2, 1.0);
    AdamMoments moments{ParameterBlock(kRows, kCount), ParameterBlock(kRows, kCount)};
    g.Row(kRows - 1)[kCount - 1] = bad;
    EXPECT_FALSE(AdamStep(g, std::vector<float>(kRows, 0.01f), 1, pool, p, moments));
  }
}

TEST_P(OptimizerTest, PenaltyGradientsAgreeWithTheirFormula) {
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

TEST_P(OptimizerTest, NeedlesAreShortenedAndFlatGaussiansAreNot) {
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

// The noise has the covariance's axes: along a needle, and for faint Gaussians only.
TEST_P(OptimizerTest, NoiseMovesFaintGaussiansAlongTheirAxes) {
  ThreadPool pool(TestCase());
  ParameterBlock p(kRows, kCount);
  for (int i = 0; i < kCount; ++i) {
    p.Row(kRotationRow)[i] = 1.0f;
    for (int k = 0; k < 3; ++k) p.Row(kLogScaleRow + k)[i] = k == 1 ? 0.0f : -10.0f;
    p.Row(kOpacityRow)[i] = i % 2 == 0 ? -7.0f : 3.0f;
  }
  AddPositionNoise(1.0f, 7, pool, p);
  double squares = 0.0;
  for (int i = 0; i < kCount; ++i) {
    EXPECT_NEAR(p.Row(0)[i], 0.0f, 1e-7f);
    EXPECT_NEAR(p.Row(2)[i], 0.0f, 1e-7f);
    if (i % 2 == 0) {
      squares += p.Row(1)[i] * p.Row(1)[i];
    } else {
      EXPECT_EQ(p.Row(1)[i], 0.0f);
    }
  }
  // Unit variance times the gate, sigmoid(100 (0.005 - sigmoid(-7)))^2 = 0.36.
  EXPECT_NEAR(squares / (kCount / 2 + 1), 0.36, 0.2);
}

INSTANTIATE_TEST_SUITE_P(Threads,
                         OptimizerTest,
                         testing::Combine(testing::Values(1, 3), EachInstructionSet()));

TEST(InstructionSetsTest, TheBestIsTheDefaultAndUnknownNamesAreRefused) {
  LimitInstructionSet("");
  EXPECT_EQ(ActiveInstructionSet(), SupportedInstructionSets().front());
  EXPECT_THROW(LimitInstructionSet("avx1024"), Error);
}

}  // namespace
}  // namespace color3d
