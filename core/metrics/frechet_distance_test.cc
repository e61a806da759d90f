#include "core/metrics/frechet_distance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "tests/reference/perceptual_golden.h"
#include "tests/support/networks/named_values.h"

namespace color3d {
namespace {

using Rows = std::vector<std::vector<float>>;

// samples() of tests/reference/perceptual_golden.py.
Rows Samples(const char* name, size_t count, size_t width) {
  Rows rows(count, std::vector<float>(width));
  for (size_t i = 0; i < count; ++i) {
    double value = 0.0;
    for (size_t k = 0; k < width; ++k) {
      value = NamedValue(name, i * width + k) + 0.5 * value;
      rows[i][k] = static_cast<float>(value);
    }
  }
  return rows;
}

TEST(FrechetDistanceTest, AgreesWithReference) {
  EXPECT_NEAR(FrechetDistance(Samples("fid.first", 40, 6), Samples("fid.second", 50, 6)),
              kFrechetOfMany,
              1e-7);
  EXPECT_NEAR(FrechetDistance(Samples("fid.first", 5, 6), Samples("fid.second", 4, 6)),
              kFrechetOfFew,
              1e-6);
}

TEST(FrechetDistanceTest, HasClosedFormForOneFeature) {
  // Deviations 1 and 3, means 0 and 4 (divisor n - 1): (4 - 0)^2 + (3 - 1)^2.
  const float a = std::sqrt(0.5f), b = 3.0f * a;
  EXPECT_NEAR(FrechetDistance({{-a}, {a}}, {{4 - b}, {4 + b}}), 20.0, 1e-5);
}

TEST(FrechetDistanceTest, NoticesShiftAndTurnedFeatures) {
  const Rows samples = Samples("fid.first", 40, 6);
  Rows shifted = samples, turned = samples;
  for (size_t i = 0; i < samples.size(); ++i) {
    shifted[i][2] += 1.0f;
    std::swap(turned[i][0], turned[i][5]);
  }
  EXPECT_NEAR(FrechetDistance(samples, samples), 0.0, 1e-9);
  EXPECT_NEAR(FrechetDistance(samples, shifted), 1.0, 1e-5);
  EXPECT_GT(FrechetDistance(samples, turned), 0.1);
}

TEST(FrechetDistanceTest, RejectsBadSamples) {
  EXPECT_THROW(FrechetDistance({}, {}), Error);
  EXPECT_THROW(FrechetDistance({{1.0f}}, {{1.0f}, {2.0f}}), Error);
  EXPECT_THROW(FrechetDistance({{1.0f}, {2.0f}}, {{1.0f}, {2.0f, 3.0f}}), Error);
  EXPECT_THROW(FrechetDistance({{1.0f}, {2.0f}}, {{1.0f}, {std::nanf("")}}), Error);
}

}  // namespace
}  // namespace color3d
